// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <vector>

#include "core/align/pattern_field.hpp"
#include "core/dense/dense_map.hpp"
#include "core/dense/surface_grid.hpp"

namespace slsd {

/// What a pixel says for a surface, against two others that could be there: one that lies elsewhere, on which dark and
/// light are as likely as each other, and one that is not lit. Natural logarithms of how much likelier the pixel's
/// level is.
struct Evidence {
  float against_another = 0, against_unlit = 0;

  [[nodiscard]] float least() const { return against_another < against_unlit ? against_another : against_unlit; }
  Evidence& operator+=(const Evidence& more) {
    against_another += more.against_another, against_unlit += more.against_unlit;
    return *this;
  }
  Evidence& operator-=(const Evidence& less) {
    against_another -= less.against_another, against_unlit -= less.against_unlit;
    return *this;
  }
};

/// Evidence, worked out beforehand: by the light that the surface should have there, what the pixel has, the slope of
/// the light, and the noise, all in units of the gain.
/// @thread reentrant
class EvidenceTable {
 public:
  EvidenceTable();
  /// @param expected  0 to 1
  /// @param seen      of 0 for dark and 1 for lit
  /// @param slope     of the light, for one camera px
  /// @param noise     one standard deviation of a pixel
  [[nodiscard]] Evidence at(float expected, float seen, float slope, float noise) const;

  /// The same, not from the table.
  [[nodiscard]] static Evidence reckon(float expected, float seen, float slope, float noise);

 private:
  std::vector<Evidence> table_;
};

/// Gives each camera pixel the surface between the grid's nodes: blended where they are one surface and all that is
/// seen agrees; elsewhere, pixel by pixel, the plane of a node nearby for which the pixel's surroundings speak most, if
/// they speak for it.
/// @thread thread-bound: keeps its buffers
class PixelJudge {
 public:
  struct Options {
    int reach_px = 3;    ///< of a pixel's surroundings, to each side
    int window_px = 11;  ///< of a node: no plane is continued farther
    double depth_min_mm, depth_max_mm;
  };
  explicit PixelJudge(const Options& options) : options_(options) {}

  void judge(const DenseFrame& frame, const PatternField& field, const PatchGeometry& geometry, const SurfaceGrid& grid,
             DenseMap& map, Executor& executor);

 private:
  static constexpr int kCandidates = 6;
  struct Scratch {
    std::vector<Evidence> evidence[kCandidates], columns;
  };
  struct Cell;
  void judge_cell(const Cell& cell, Scratch& scratch) const;
  void blend(const Cell& cell) const;
  void judge_pixels(const Cell& cell, bool one_surface, Scratch& scratch) const;
  template <class T>
  void weigh(const ImageView<T>& pixels, const Cell& cell, int candidate, std::vector<Evidence>& evidence) const;
  void write(const Cell& cell, int x, int y, float inverse_depth, float sigma_px, float per_px, float light,
             bool firm) const;

  Options options_;
  EvidenceTable table_;
  std::vector<Scratch> scratch_;
};

}  // namespace slsd
