// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/decode/decode_windows.hpp"
#include "core/decode/grey_moments.hpp"
#include "core/decode/link_grid.hpp"
#include "core/decode/prototypes.hpp"

namespace slsd {

/// How the map from the pattern to the camera bends around a symbol: its second derivatives, camera px per projector px
/// squared.
struct Bend {
  Eigen::Vector2f uu{0, 0}, uv{0, 0}, vv{0, 0};
};

/// Where the camera sees the point of the surface that a symbol's centroid in the projector lights. The centroid of the
/// symbol's image is not that point: perspective and curvature show more of one half than of the other, by some
/// hundredths of a pixel on planes and by half a pixel at the limb of a cylinder. With the map c(u) = c0 + F u + Q(u)/2
/// around the centroid, M the symbol's second moments and J = det(dc/du),
///
///     centroid of the image = c0 + Q(M)/2 + F M grad(log J)
///
/// and Q follows from the neighbours, whose second differences span a whole pitch: their noise enters with a weight of
/// some percent.
/// @thread thread-bound: keeps its buffers
class CentreCorrection {
 public:
  CentreCorrection(const std::vector<Prototype>& prototypes, float pitch_px, float symbol_size_px);

  /// @param letters    of the nodes' cells, -1 where they have none
  /// @param corrected  camera pixels, one to a node
  void correct(const std::vector<GridNode>& nodes, const std::vector<GreyMoments>& moments,
               const std::vector<CellClaim>& claims, const std::vector<std::int8_t>& letters,
               std::vector<Eigen::Vector2f>& corrected);

 private:
  struct Derivatives {
    Bend bend;
    bool has_uu = false, has_uv = false, has_vv = false;
  };
  void find_named_neighbours(const std::vector<GridNode>& nodes, const std::vector<CellClaim>& claims);
  void measure_bends(const std::vector<GridNode>& nodes, const std::vector<CellClaim>& claims);
  template <class Part>
  [[nodiscard]] Eigen::Vector2f median_around(const std::vector<GridNode>& nodes, std::int32_t node,
                                              bool Derivatives::*has, Part part) const;
  /// Nothing where it is negligible.
  [[nodiscard]] std::optional<Bend> bend_of(const std::vector<GridNode>& nodes, std::int32_t node) const;
  [[nodiscard]] std::int32_t named_neighbour(const std::vector<GridNode>& nodes, const std::vector<CellClaim>& claims,
                                             std::int32_t node, Direction direction) const;

  float pitch_px_;
  float negligible_bend_;
  std::vector<Eigen::Vector2f> centroids_px_;
  std::vector<Eigen::Matrix2f> second_moments_px2_;
  std::vector<Eigen::Vector2f> centres_;            // of the squares
  std::vector<std::array<std::int32_t, 4>> named_;  // by Direction: neighbours that are decoded, and as such agree
  std::vector<Derivatives> derivatives_;
};

}  // namespace slsd
