// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/code/pattern.hpp"
#include "core/decode/grid/sightings.hpp"
#include "core/executor.hpp"
#include "core/image.hpp"

namespace slsd {

struct ReviewOptions {
  /// Change of the light from cell to cell from which on a symbol is measured again with the light levelled.
  float shading_min = 0.04F;
  /// The same from which on the centre is the steady one.
  float uneven_light = 0.1F;
  /// Standard deviations from its letter's prototype from which on a symbol is measured again where its neighbours put
  /// it.
  float doubtful_distance = 1.5F;
  /// Largest distance from its region at which review may find the symbol, of the pitch.
  float moved_max = 0.25F;
  /// Distance from its letter beyond which a symbol at the edge of the decoded area is damaged: an edge or a shadow may
  /// cut it.
  float damaged_distance = 2.5F;
  /// The same limit for a symbol on the grid of its neighbours: it may have been printed on.
  float damaged_distance_on_grid = 4;
  /// The same limit for a symbol among named neighbours on all sides. Print and relief disturb its shape, but its cell
  /// is certain; its sigma tells how much they may move its centre.
  float damaged_distance_held = kTornDistance;
  Rules rules = {};
};

/// Looks again at every symbol whose cell is known: with the frame that its whole neighbours show, with the light
/// levelled as their brightness tells, and, where its shape still is not that of its letter, inside its cell instead of
/// inside its mask. What is far from whole then is rejected: its centre would be wrong.
/// @thread thread-bound: keeps its buffers
class SymbolReview {
 public:
  SymbolReview(const Pattern& pattern, ReviewOptions options);

  /// Look of the letters in measured frames.
  struct Look {
    const std::vector<Prototype>& prototypes;
    const Classifier& classifier;  ///< made from the prototypes
  };
  /// @param meters  one to a worker
  /// @param seen    in and out: moments, frames and claims change
  void review(const GreyView& frame, const Regions& regions, const GridLinker& linker, const Look& look,
              std::span<GreyMomentMeter> meters, Executor& executor, Sightings& seen);

 private:
  void measure_around_distrusted(const GridLinker& linker, Sightings& seen);
  void trust_whole_symbols(const GridLinker& linker, const Classifier& letters, Executor& executor, Sightings& seen);
  void measure_distances(const Classifier& letters, Executor& executor, Sightings& seen);
  void measure_light_changes(const Sightings& seen, Executor& executor);
  [[nodiscard]] Eigen::Vector2f light_change_around(const Sightings& seen, std::size_t node) const;
  [[nodiscard]] bool is_inside(const Sightings& seen, std::size_t node) const;
  [[nodiscard]] std::optional<LatticeFrame> frame_around(const Sightings& seen, std::size_t node) const;
  [[nodiscard]] float distance_in(const Sightings& seen, std::size_t node, const GreyMoments& moments,
                                  const LatticeFrame& lattice_frame) const;
  [[nodiscard]] float distance_from_letter(const Sightings& seen, std::size_t node, const GreyMoments& moments) const;
  [[nodiscard]] float nearer_around(const Sightings& seen, std::size_t node, const GreyMoments& moments,
                                    float own) const;
  [[nodiscard]] const Prototype& prototype_of(const CellClaim& claim) const {
    return (*prototypes_)[array_.at(claim.row, claim.column)];
  }
  template <class T>
  void review_node(const ImageView<T>& frame, const Regions& regions, GreyMomentMeter& meter, Sightings& seen,
                   std::size_t node) const;

  CodeArray array_;
  const std::vector<Prototype>* prototypes_ = nullptr;  // of this review
  float size_px_, pitch_px_;
  ReviewOptions options_;
  std::vector<std::uint8_t> trusted_;
  std::vector<std::uint8_t> decoded_;  // of each node, when the review began
  std::vector<std::int32_t> distrusted_;
  std::vector<Eigen::Vector2f> light_changes_;  // from cell to cell along u and v, relative
};

}  // namespace slsd
