// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/code/codebook.hpp"
#include "core/code/pattern.hpp"
#include "core/decode/grid/sightings.hpp"
#include "core/executor.hpp"
#include "core/image.hpp"

namespace slsd {

struct ReviewOptions {
  /// Change of the light from cell to cell above which a symbol is measured again with the light levelled.
  float shading_min = 0.04F;
  /// Change of the light above which the steady centre is used.
  float uneven_light = 0.1F;
  /// Distance from its letter's prototype, standard deviations, above which a symbol is measured again at the place
  /// that its neighbours predict.
  float doubtful_distance = 1.5F;
  /// Largest distance from its region at which review may find the symbol, as a share of the pitch.
  float moved_max = 0.25F;
  /// Distance from its letter above which a symbol at the edge of the decoded area is damaged: an edge or a shadow may
  /// cut it.
  float damaged_distance = 2.5F;
  /// The same limit for a symbol on the grid of its neighbours, which print may distort.
  float damaged_distance_on_grid = 4;
  /// The same limit for a symbol among decoded neighbours on all sides. Print and relief disturb its shape, but its
  /// cell is certain; its sigma covers the displacement of its centre.
  float damaged_distance_held = kSplitDistance;
  Rules rules = {};
};

/// Measures every symbol of known cell again, with the frame of its whole neighbours and the light levelled by their
/// brightness. If its shape still differs from its letter, review measures it inside its cell instead of inside its
/// mask. Symbols that remain far from whole are rejected: their centres would be wrong.
/// @thread thread-bound: keeps its buffers
class SymbolReview {
 public:
  SymbolReview(const IndexedPattern& pattern, ReviewOptions options);

  /// Look of the letters in measured frames.
  struct Look {
    const std::vector<Prototype>& prototypes;
    const Classifier& classifier;  ///< made from the prototypes
  };
  /// @param meters  one for each worker
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
    return (*prototypes_)[array_->at(claim.row, claim.column)];
  }
  template <class T>
  void review_node(const ImageView<T>& frame, const Regions& regions, GreyMomentMeter& meter, Sightings& seen,
                   std::size_t node) const;

  std::shared_ptr<const CodeArray> array_;
  const std::vector<Prototype>* prototypes_ = nullptr;  // prototypes of the current review
  float size_px_, pitch_px_;
  ReviewOptions options_;
  std::vector<std::uint8_t> trusted_;
  std::vector<std::uint8_t> decoded_;  // for each node, at the start of the review
  std::vector<std::int32_t> distrusted_;
  std::vector<std::uint8_t> is_around_;  // for each node: whether its frame is measured with one that is distrusted
  std::vector<Eigen::Vector2f> light_changes_;  // relative change from cell to cell along u and v
};

}  // namespace slsd
