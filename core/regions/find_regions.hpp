// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/executor.hpp"
#include "core/regions/mask.hpp"

namespace slsd {

/// Lit pixels left to right - 1 of a row. Aligned so that it is copied as one number.
struct alignas(8) Run {
  std::int16_t row, left, right;
};

/// A set of lit pixels that touch along an edge or at a corner (8-connected).
struct Region {
  int left, top, right, bottom;  ///< its box, the last column and row inside
  int area_px;
  int first_run, run_count;  ///< runs in Regions::runs, in raster order

  [[nodiscard]] Eigen::Vector2f middle_px() const {
    return {0.5F * static_cast<float>(left + right), 0.5F * static_cast<float>(top + bottom)};
  }
  [[nodiscard]] int width_px() const { return right - left + 1; }
  [[nodiscard]] int height_px() const { return bottom - top + 1; }
};

/// The regions of a mask in the raster order of their first pixels.
struct Regions {
  std::vector<Region> regions;
  std::vector<Run> runs;

  /// Adds a region from another set.
  void append(const Region& region, std::span<const Run> region_runs) {
    regions.push_back(region);
    regions.back().first_run = static_cast<int>(runs.size());
    runs.insert(runs.end(), region_runs.begin(), region_runs.end());
  }

  [[nodiscard]] std::span<const Run> runs_of(const Region& region) const {
    return {runs.data() + region.first_run, static_cast<std::size_t>(region.run_count)};
  }
};

/// Labels 8-connected regions by runs and union-find (Haralick and Shapiro's local table method, on runs). Bands of
/// rows are labelled separately and then joined.
/// @thread thread-bound: keeps its buffers
class RegionFinder {
 public:
  /// @param mask  of a readable size
  void find(const Mask& mask, Regions& found, Executor& executor);
  void find(const Mask& mask, Regions& found) {
    SerialExecutor alone;
    find(mask, found, alone);
  }

 private:
  /// A part of a region, found row by row. Its parent has no higher number, so labels of one region share a root.
  struct Label {
    std::int32_t parent, runs;
  };
  using Labels = std::vector<Label>;
  struct Band {
    std::vector<std::uint16_t> ends[2];  // a row's runs, alternating left and right, then one run beyond all others
    std::vector<Run> runs;               // run_count runs, then spare room
    std::vector<std::int32_t> label_of_run;
    Labels labels;
    std::size_t run_count = 0, first_row_runs = 0, first_of_last_row = 0;
    std::int32_t first_label = 0;  // index among the labels of all bands
  };
  static void label_rows(const Mask& mask, int top, int bottom, Band& band);
  static void label_row(int y, int runs, const std::uint16_t* above_ends, const std::uint16_t* ends,
                        std::size_t first_above, Band& band);
  [[nodiscard]] static std::int32_t join(Labels& labels, std::int32_t a, std::int32_t b);
  [[nodiscard]] static std::int32_t root(Labels& labels, std::int32_t label);
  void collect_labels(std::span<Band> bands);
  void join_bands(const Band& above, const Band& below);
  void number_regions(Regions& found);
  void place_runs(std::span<const Band> bands, Regions& found);
  void gather(const Band& band, Regions& found);

  std::vector<Band> bands_;
  Labels labels_;                              // labels of all bands
  std::vector<std::int32_t> next_run_;         // for each label that is the first of its region in its band
  std::vector<std::int32_t> holder_, cursor_;  // for each region
};

}  // namespace slsd
