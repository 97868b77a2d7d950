// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/code/codebook.hpp"
#include "core/decode/centres/centre_sigma.hpp"
#include "core/decode/centres/correspond.hpp"
#include "core/decode/centres/curvature.hpp"
#include "core/decode/centres/recover_symbols.hpp"
#include "core/decode/centres/symbol_match.hpp"
#include "core/decode/decoding.hpp"
#include "core/decode/grid/epipolar_view.hpp"
#include "core/decode/grid/lattice_frame.hpp"
#include "core/decode/grid/link_grid.hpp"
#include "core/decode/grid/sightings.hpp"
#include "core/decode/inference/infer_cells.hpp"
#include "core/decode/lattice.hpp"
#include "core/decode/options.hpp"
#include "core/decode/paper_way.hpp"
#include "core/decode/regions/shape_finder.hpp"
#include "core/decode/symbols/appearance.hpp"
#include "core/decode/symbols/review_symbols.hpp"
#include "core/exposure/frame_noise.hpp"

namespace slsd {

/// The stages of a frame, from its grey values to the lattice of its symbols. A copy is for another thread; it shares
/// large constant data.
/// @thread thread-bound: keeps its buffers
class SymbolReader {
 public:
  /// @param expected   local frames of the pattern, to half a step of the grid
  /// @param projector  the projector whose pixels the symbols are
  /// @param paper      null unless a stage uses the paper's method
  /// @param known      shared if they fit; may be null
  SymbolReader(const IndexedPattern& pattern, const Lens& projector, ExpectedFrames expected,
               const DecodeOptions& options, std::optional<PaperWay> paper,
               std::shared_ptr<const Appearances> known = nullptr);

  /// Replaces the expected frames by others of the same scale, to an eighth.
  void expect(ExpectedFrames expected) { finder_.expect(std::move(expected)); }
  /// Reads these pixels of the frame only; empty: all of them. See ShapeFinder.
  void set_part(const std::optional<PixelRectangle>& part) { finder_.set_part(part); }
  [[nodiscard]] float expected_scale() const { return finder_.expected().in_the_middle().scale; }

  /// Runs all stages in order.
  /// @param full  the level of a saturated pixel of the frame
  /// @param view  from the calibration; null: symbols may lie anywhere, and without their epipolar lines as a check,
  ///              some in a thousand are wrong
  /// @return      valid until the next call
  const Lattice& read(const GreyView& frame, double full, EpipolarView* view, Executor& executor,
                      StageObserver* observer = nullptr);
  /// The same as pairs of pixels, for symbols anywhere.
  /// @param is_there  whether the pattern is likely visible; otherwise measuring its blur is not worth the time
  [[nodiscard]] std::vector<SymbolMatch> read_anywhere(const GreyView& frame, double full,
                                                       const std::optional<FrameNoise>& noise, bool is_there = true);

  /// Lists symbols of the last frame whose cells are certain but that lie off their epipolar lines, with their places
  /// in the frame.
  void list_off_line(std::vector<SymbolMatch>& matches) const;
  /// Marks a symbol that turned out to be no point.
  void reject(const LatticeSymbol& symbol, DecodeRule by) { seen_.claims[symbol.sighting].decide(by); }
  /// Reports the status of every region, with the counters.
  void report(Decoding& decoding) const;

  [[nodiscard]] const std::shared_ptr<const Appearances>& appearances() const { return fixed_->appearances; }
  [[nodiscard]] const Pattern& pattern() const { return fixed_->pattern.pattern(); }
  /// Returns the noise of the last frame.
  [[nodiscard]] const FrameNoise& noise() const { return noise_; }
  /// Blur at the sharpest edges of the last frame, one standard deviation; 0 if there are none, or by the paper's way.
  [[nodiscard]] float edge_blur_px() const { return finder_.edge_blur_px(); }
  [[nodiscard]] const CellRays& cells() const { return fixed_->cells; }
  /// Number of shapes of a symbol's size in the last frame.
  [[nodiscard]] std::size_t shapes() const { return seen_.size(); }

 private:
  struct Fixed {
    IndexedPattern pattern;
    std::shared_ptr<const Appearances> appearances;
    CellRays cells;
    Fixed(const IndexedPattern& pattern, const Lens& projector, Method centre,
          std::shared_ptr<const Appearances> appearances);
  };

  void measure_look();
  void classify(Executor& executor);
  void link_grid(Executor& executor);
  void classify_in_measured_frames(Executor& executor);
  void infer_cells(const GreyView& frame, EpipolarView* view, Executor& executor);
  void review(const GreyView& frame, Executor& executor);
  [[nodiscard]] CellGate gate_of(const EpipolarView* view) const;
  /// Blur of the pattern in this frame, standard deviation, projector px.
  [[nodiscard]] float blur_px() const;
  void recover(const GreyView& frame, const CellGate& gate, EpipolarView* view, Executor& executor);
  void correspond(const EpipolarView* view, Executor& executor);
  void refuse_cut();
  void fit_lattice(const GreyView& frame, double full, const EpipolarView* view, Executor& executor);

  DecodeOptions options_;
  std::shared_ptr<const Fixed> fixed_;
  std::optional<PaperWay> paper_;
  ShapeFinder finder_;
  GridLinker linker_;
  CellInference inference_;
  SymbolReview review_;
  std::shared_ptr<const LetterFields> letters_;
  SymbolRecovery recovery_;
  Correspondence correspondence_;
  CentreCorrection centre_correction_;
  CentreJudge centre_judge_;

  bool is_there_ = true;
  const Appearance* look_ = nullptr;  // for this frame's symbols
  std::vector<ShapeFeatures> sample_;
  std::vector<std::int32_t> kept_;  // indices of the lattice's symbols after rejection
  Sightings seen_;
  Lattice lattice_;
  std::optional<FrameNoise> known_noise_;
  FrameNoise noise_;  // noise of the original frame, not of the sharpened one
};

}  // namespace slsd
