// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/appearance/blurred_pattern.hpp"
#include "core/appearance/tone_curve.hpp"
#include "core/code/pattern.hpp"
#include "core/decode/decoder.hpp"
#include "core/dense/dense_map.hpp"
#include "core/dense/nodes/refine_grid.hpp"
#include "core/dense/nodes/search_surface.hpp"
#include "core/dense/nodes/surface_grid.hpp"
#include "core/dense/pixels/clean_map.hpp"
#include "core/dense/pixels/occlusion.hpp"
#include "core/dense/pixels/pixel_judge.hpp"
#include "core/dense/stream/follow_grid.hpp"
#include "core/executor.hpp"
#include "core/geometry/measured_box.hpp"

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

/// Measures the surface between decoded symbols, with a point for each camera pixel: docs/dense.md.
/// @thread thread-bound: keeps its buffers; shares constant data with mappers made by another()
class DenseMapper {
 public:
  /// @param camera_index  index in the calibration, whose projector has the size of the pattern
  DenseMapper(const Pattern& pattern, const Calibration& calibration, std::size_t camera_index,
              const DecodeOptions& decode);
  /// Makes a mapper of the same kind for another thread.
  [[nodiscard]] DenseMapper another() const;

  /// @param symbols  symbols decoded in this frame
  /// @return         valid until the next call, which overwrites it. The caller may move another map there, whose
  ///                 memory is then reused
  DenseMap& measure(const GreyView& frame, double full, const DecodedSymbols& symbols, Executor& executor,
                    DenseObserver* observer = nullptr) {
    return measure(frame, full, symbols, executor, observer, false);
  }
  /// Measures the next frame of a stream. If the scene stands still, this costs only a part of measure(): see
  /// GridFollower. The cloud is as exact as that of measure(), but not identical to the last bit.
  DenseMap& measure_next(const GreyView& frame, double full, const DecodedSymbols& symbols, Executor& executor,
                         DenseObserver* observer = nullptr) {
    return measure(frame, full, symbols, executor, observer, true);
  }

  /// Limits measuring to these pixels of the frame; empty: all of them. They get the points that they have in the whole
  /// frame, except where only surfaces outside the part hide them from the projector. In a stream, too, each frame of a
  /// part is measured afresh.
  void set_part(const std::optional<PixelRectangle>& part);
  /// Pixels whose symbols matter for the part; nothing: all of them.
  [[nodiscard]] std::optional<PixelRectangle> part_of_symbols() const;

  /// Frees what measure_next() keeps of frames. @thread reentrant, even during measurements
  void end_stream() { follower_.forget(); }

  /// Memory in use, without the shared fields: see bytes_of_fields().
  [[nodiscard]] std::size_t bytes() const;
  /// Largest memory of the pattern's fields.
  [[nodiscard]] static std::size_t bytes_of_fields(const Lens& projector);
  /// The stride for a frame: dense_stride_px, unless the frame is so large that it would take more than kNodesMost
  /// nodes, some 300 MB.
  [[nodiscard]] static int stride_px(const Lens& camera, const DenseOptions& options);
  static constexpr std::size_t kNodesMost = 2'000'000;

  /// Prepares in advance what the first frame would otherwise wait for.
  void warm_up();

  /// The map of the last frame, whose memory the next one reuses. A caller may take it away, and give another.
  [[nodiscard]] DenseMap& map() { return map_; }
  /// Returns the rays of the camera's pixels.
  [[nodiscard]] const std::shared_ptr<const RayGrid>& rays() const;
  /// The side of the patches to which the surface is fitted.
  [[nodiscard]] int window_px() const;
  /// Returns the seeds of the last frame, from which the surface grew.
  [[nodiscard]] std::span<const SurfaceSeed> seeds() const { return seeds_; }
  [[nodiscard]] const SurfaceGrid& grid() const { return grid_; }
  /// Number of nodes that the last frame took over from the previous one.
  [[nodiscard]] std::size_t followed_nodes() const { return followed_; }
  /// Usual blur of the pattern in the last frame, projector px; 0 before the first.
  [[nodiscard]] float blur_sigma_px() const { return pattern_ ? pattern_.usual().blur_sigma_px() : 0; }
  /// Power of the light that the last frame's levels are, see ToneCurve.
  [[nodiscard]] float tone_power() const { return tone_.power(); }
  /// Offset of the pattern from its epipolar lines at the centre of the last frame, projector px.
  [[nodiscard]] float epipolar_offset_px() const { return grid_.epipolar_offset().middle + across_px_; }

 private:
  struct Fixed;
  explicit DenseMapper(std::shared_ptr<const Fixed> fixed);
  void find_seeds(const DecodedSymbols& symbols, Executor& executor);
  [[nodiscard]] DenseFrame develop(const DenseFrame& frame);
  [[nodiscard]] DenseFrame find_pattern(const DenseFrame& frame, Executor& executor);
  DenseMap& measure(const GreyView& frame, double full, const DecodedSymbols& symbols, Executor& executor,
                    DenseObserver* observer, bool next);
  void map_surface(const DenseFrame& seen, const PixelRectangle& within, const FollowedFrame* from, bool next,
                   Executor& executor, DenseObserver* observer);
  void map_part(const DenseFrame& seen, Executor& executor, DenseObserver* observer);

  std::shared_ptr<const Fixed> fixed_;  // shared by mappers of several threads
  SurfaceGrid grid_;
  GridRefiner refiner_;
  SurfaceSearch search_;
  GridFollower follower_;
  std::size_t followed_ = 0;  // nodes taken over in the last frame
  float across_px_ = 0;       // their mean move across the epipolar lines
  PixelJudge judge_;
  Occlusion occlusion_;
  MapCleaner cleaner_;
  std::vector<SurfaceSeed> seeds_;
  ToneCurve tone_;
  BlurredPattern pattern_;  // the pattern as the last frame shows it
  DenseMap map_;
  std::optional<PixelRectangle> part_;
  std::unique_ptr<DenseMapper> of_part_;  // of a camera that sees the part and some pixels around it
  PixelRectangle around_part_;            // what it sees
};

}  // namespace slsd
