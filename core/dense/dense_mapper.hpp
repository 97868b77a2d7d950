// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/align/pattern_field.hpp"
#include "core/code/pattern.hpp"
#include "core/decode/decoder.hpp"
#include "core/dense/clean_map.hpp"
#include "core/dense/dense_map.hpp"
#include "core/dense/follow_grid.hpp"
#include "core/dense/pixel_judge.hpp"
#include "core/dense/search_surface.hpp"
#include "core/dense/surface_grid.hpp"
#include "core/executor.hpp"

namespace slsd {

enum class DenseStage : std::uint8_t { kFindBlur, kGrow, kSearch, kFuse, kJudge, kClean };
inline constexpr int kDenseStageCount = 6;
[[nodiscard]] std::string_view to_string(DenseStage stage);

/// Observer of a mapper's stages, called as each ends.
class DenseObserver {
 public:
  virtual ~DenseObserver() = default;
  virtual void stage_done(DenseStage stage) = 0;
};

/// Measures the surface between decoded symbols, a point to a camera pixel: docs/dense.md.
/// @thread thread-bound: keeps its buffers; what never changes is shared with those that another() makes
class DenseMapper {
 public:
  /// @param camera_index  in the calibration; the calibration's projector is of the pattern's size
  DenseMapper(const Pattern& pattern, const Calibration& calibration, std::size_t camera_index,
              const DecodeOptions& decode);
  /// Makes a mapper of the same kind for another thread.
  [[nodiscard]] DenseMapper another() const;

  /// @param symbols  those that the decoder has found in this frame
  /// @return         stands until the next call, which writes over whatever is there: another map may be put in its
  ///                 place, whose memory is then used
  DenseMap& measure(const GreyView& frame, double full, const DecodedSymbols& symbols, Executor& executor,
                    DenseObserver* observer = nullptr) {
    return measure(frame, full, symbols, executor, observer, false);
  }
  /// The same of the next frame of a stream: where the scene stands still since the frame before, this costs a part of
  /// it, see GridFollower. The cloud is as exact, and not to the last bit that of measure().
  DenseMap& measure_next(const GreyView& frame, double full, const DecodedSymbols& symbols, Executor& executor,
                         DenseObserver* observer = nullptr) {
    return measure(frame, full, symbols, executor, observer, true);
  }

  /// Gives back what measure_next() keeps of frames. @thread reentrant, also while another measures
  void end_stream() { follower_.forget(); }

  /// Memory that it holds, without what it shares with others: that is bytes_of_fields().
  [[nodiscard]] std::size_t bytes() const;
  /// Memory of the pattern's fields at most, one for each blur.
  [[nodiscard]] static std::size_t bytes_of_fields(const Lens& projector);
  /// The stride that a frame is measured with: as dense_stride_px says, but for frames so large that it would take more
  /// than kNodesMost nodes, some 300 MB.
  [[nodiscard]] static int stride_px(const Lens& camera, const DenseOptions& options);
  static constexpr std::size_t kNodesMost = 2'000'000;

  /// Makes beforehand what the first frame would wait for.
  void warm_up(Executor& executor);

  /// Returns the rays of the camera's pixels.
  [[nodiscard]] const std::shared_ptr<const RayGrid>& rays() const;
  /// The side of the patches that the surface is fitted to.
  [[nodiscard]] int window_px() const;
  /// Returns the places at which growth began in the last frame, and the surface that grew.
  [[nodiscard]] std::span<const SurfaceSeed> seeds() const { return seeds_; }
  [[nodiscard]] const SurfaceGrid& grid() const { return grid_; }
  /// Number of the surface's nodes that the last frame took over from the frame before.
  [[nodiscard]] std::size_t followed_nodes() const { return followed_; }
  /// Blur of the pattern in the last frame, projector px.
  [[nodiscard]] float blur_sigma_px() const { return PatternFields::kBlursPx[blur_]; }
  /// Offset of the pattern from its epipolar lines in the middle of the last frame, projector px.
  [[nodiscard]] float epipolar_offset_px() const { return grid_.epipolar_offset().middle + across_px_; }

 private:
  struct Fixed;
  explicit DenseMapper(std::shared_ptr<const Fixed> fixed);
  void find_seeds(const DecodedSymbols& symbols);
  void find_blur(const DenseFrame& frame);
  const PatternField& find_field(const DenseFrame& frame);
  DenseMap& measure(const GreyView& frame, double full, const DecodedSymbols& symbols, Executor& executor,
                    DenseObserver* observer, bool next);

  std::shared_ptr<const Fixed> fixed_;  // shared: mappers of several threads use one
  SurfaceGrid grid_;
  SurfaceSearch search_;
  GridFollower follower_;
  std::size_t followed_ = 0;  // nodes, of the last frame
  float across_px_ = 0;       // what these went
  PixelJudge judge_;
  MapCleaner cleaner_;
  std::vector<SurfaceSeed> seeds_;
  std::size_t blur_ = 1;
  DenseMap map_;
};

}  // namespace slsd
