// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <vector>

#include "core/code/pattern.hpp"
#include "core/decode/cell_gate.hpp"
#include "core/decode/curvature.hpp"
#include "core/decode/decode_windows.hpp"
#include "core/decode/decoding.hpp"
#include "core/decode/lattice_frame.hpp"
#include "core/decode/link_grid.hpp"
#include "core/decode/options.hpp"
#include "core/decode/paper/paper_way.hpp"
#include "core/decode/review_symbols.hpp"
#include "core/decode/shape_finder.hpp"
#include "core/decode/sightings.hpp"
#include "core/decode/symbol_match.hpp"

namespace slsd {

/// The stages of a frame that need no calibration, from the grey values to the cell of each symbol, with every buffer
/// that they need.
/// @thread thread-bound
class SymbolReader {
 public:
  /// @param expected  how the pattern lies in the frame, to half a step of the grid
  /// @param paper     there where a stage is asked for the paper's way
  SymbolReader(const Pattern& pattern, ExpectedFrames expected, const DecodeOptions& options,
               std::optional<PaperWay> paper);

  /// Of the same scale, to an eighth.
  void expect(ExpectedFrames expected) { shapes_.expect(std::move(expected)); }
  [[nodiscard]] float expected_scale() const { return shapes_.expected().in_the_middle().scale; }

  /// @param full  the level of a saturated pixel of the frame
  void binarize(const GreyView& frame, double full) { shapes_.binarize(frame, full); }
  void find_regions(const GreyView& frame) { shapes_.find_regions(frame); }
  void describe(const GreyView& frame);
  void classify();
  void link_grid();
  void decode_windows(const GreyView& frame, const CellGate& gate);
  /// Where the camera sees what each symbol's centroid in the projector lights: one to a sighting.
  [[nodiscard]] const std::vector<Eigen::Vector2f>& find_centres();
  /// All of these, for symbols that lie wherever they may: without their epipolar lines to check them by, some in a
  /// thousand are wrong.
  [[nodiscard]] std::vector<SymbolMatch> read_anywhere(const GreyView& frame, double full, const CellRays& cells);
  /// What became of every region, with the counters.
  void report(Decoding& decoding) const;

  [[nodiscard]] const Pattern& pattern() const { return pattern_; }
  /// The rays of the pattern's cells, whose centroids are those that the estimator in use finds.
  [[nodiscard]] CellRays cell_rays(const Lens& projector) const;
  [[nodiscard]] Sightings& seen() { return seen_; }
  [[nodiscard]] const Sightings& seen() const { return seen_; }
  /// Index of a sighting's cell in the pattern's symbols, or -1; found with the centres.
  [[nodiscard]] std::int8_t letter_of_cell(std::size_t node) const { return letters_[node]; }
  /// Levels of the frame for one of 255.
  [[nodiscard]] float frame_levels() const { return shapes_.frame_levels(); }

 private:
  struct Prototypes {
    std::vector<Prototype> as_expected, as_measured;
  };
  [[nodiscard]] static Prototypes prototypes_for(const Pattern& pattern, float scale);
  SymbolReader(Prototypes prototypes, const Pattern& pattern, ExpectedFrames&& expected, const DecodeOptions& options,
               std::optional<PaperWay>&& paper);

  void classify_in_measured_frames();
  [[nodiscard]] bool reviews() const;

  Pattern pattern_;
  DecodeOptions options_;
  std::optional<PaperWay> paper_;
  ShapeFinder shapes_;
  Prototypes prototypes_;
  Classifier classifier_as_expected_, classifier_as_measured_;

  GridLinker linker_;
  WindowDecoder window_decoder_;
  SymbolReview review_;
  CentreCorrection centre_correction_;

  Sightings seen_;
  std::vector<std::int8_t> letters_;
  std::vector<Eigen::Vector2f> centres_;
};

}  // namespace slsd
