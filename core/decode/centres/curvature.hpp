// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/decode/grid/link_grid.hpp"
#include "core/decode/grid/sightings.hpp"
#include "core/decode/lattice.hpp"
#include "core/decode/symbols/grey_moments.hpp"
#include "core/decode/symbols/prototypes.hpp"

namespace slsd {

/// Finds the image of the point that a symbol's centroid in the projector lights. The centroid of the symbol's image is
/// not that point: perspective and curvature enlarge one half. The error is some hundredths of a pixel on planes, and
/// half a pixel at the limb of a cylinder. Let c(u) = c0 + F u + Q(u)/2 be the map around the centroid, M the symbol's
/// second moments and J = det(dc/du). Then
///
///     centroid of the image = c0 + Q(M)/2 + F M grad(log J)
///
/// Q follows from the second differences of the neighbours, over one pitch, or over two if they are slight. Their noise
/// enters with a weight of some percent.
/// @thread thread-bound: keeps its buffers
class CentreCorrection {
 public:
  CentreCorrection(const std::vector<Prototype>& prototypes, float pitch_px, float symbol_size_px);

  /// @param misfits  misfits of the nodes, if known
  /// @param array    the pattern's array: the letters of the cells
  /// @param lattice  becomes one symbol for each decoded node, in order, with its place, map and neighbours;
  /// CentreSigma fills in the sigma
  void correct(const std::vector<GridNode>& nodes, const std::vector<GreyMoments>& moments,
               const std::vector<CellClaim>& claims, const CodeArray& array, Executor& executor, Lattice& lattice,
               std::span<const float> misfits = {});

 private:
  struct Derivatives {
    Bend bend;
    bool has_uu = false, has_uv = false, has_vv = false;
    bool is_slight = false;
    Bend over_two;  // for slight bends, from twice as far: a quarter of the noise
  };
  using Neighbours = std::array<std::int32_t, 4>;  // symbols by Direction, or -1
  [[nodiscard]] Neighbours find_neighbours(const std::vector<GridNode>& nodes, std::int32_t node) const;
  void measure_bends(std::int32_t symbol);
  template <class Part>
  [[nodiscard]] Eigen::Vector2f median_around(const std::vector<GridNode>& nodes, std::int32_t symbol,
                                              bool Derivatives::*has, Part part) const;
  [[nodiscard]] Bend slight_bend_around(std::int32_t symbol) const;
  [[nodiscard]] Bend bend_of(const std::vector<GridNode>& nodes, std::int32_t symbol) const;

  std::vector<Prototype> prototypes_;
  float size_px_;
  float pitch_px_;
  float slight_bend_;
  std::vector<Eigen::Vector2f> centroids_px_;
  std::vector<Eigen::Matrix2f> second_moments_px2_;
  std::vector<std::int32_t> cells_;       // for each decoded node, numbered by rows; -1 for others
  std::vector<std::int32_t> symbol_of_;   // for each node, or -1
  std::vector<std::int32_t> sightings_;   // for each symbol: its node
  std::vector<Eigen::Vector2f> centres_;  // centre of each symbol's square
  std::vector<Neighbours> neighbours_;    // for each symbol
  std::vector<Derivatives> derivatives_;  // for each symbol
};

}  // namespace slsd
