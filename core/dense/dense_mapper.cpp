// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/dense_mapper.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include <Eigen/LU>

#include "core/decode/grid/lattice_frame.hpp"
#include "core/exposure/frame_noise.hpp"

namespace slsd {
namespace {

/// Share of a cell that a node's window covers, less some pixels, within limits. Smaller windows have too few edges,
/// larger ones bend more. Small symbols have more edges to a cell.
constexpr double kWindowOfPitch = 0.86, kWindowLessPx = 3;
constexpr int kWindowLeastPx = 11, kWindowMostPx = 21;

/// Side of a window. It is at least the stride, so that every pixel lies in some node's window.
int window_px(double pitch_in_camera_px, int stride_px) {
  const int px = static_cast<int>(std::lround(kWindowOfPitch * pitch_in_camera_px - kWindowLessPx));
  return std::clamp(px, std::max(kWindowLeastPx, stride_px), kWindowMostPx) | 1;
}

int judge_reach_px(double pitch_in_camera_px) {
  return std::clamp(static_cast<int>(std::lround(0.17 * pitch_in_camera_px)), 3, 5);
}

/// Half the gap to bridge: dark areas within a symbol and between two.
int close_px(double pitch_in_camera_px) {
  return std::max(2, static_cast<int>(std::lround(0.3 * pitch_in_camera_px)));
}

}  // namespace

std::string_view to_string(DenseStage stage) {
  constexpr std::array<std::string_view, kDenseStageCount> kNames{"find_blur", "grow",  "search",
                                                                  "fuse",      "judge", "clean"};
  return kNames[static_cast<std::size_t>(stage)];
}

struct DenseMapper::Fixed {
  PatchGeometry geometry;
  DecodeOptions decode;
  int letters, window_px, reach_px, close_px;
  std::shared_ptr<const PatternFields> fields;  // shared with parts of the frame
  std::shared_ptr<const RayGrid> rays;

  /// The same for a camera that sees only these pixels.
  [[nodiscard]] std::shared_ptr<const Fixed> of_part(const PixelRectangle& pixels, int stride_px) const {
    CalibratedCamera camera = geometry.camera;
    camera.lens = pixels.crop(camera.lens);
    DecodeOptions options = decode;
    options.dense.stride_px = stride_px;
    return std::shared_ptr<const Fixed>(new Fixed{PatchGeometry(camera, geometry.projector), options, letters,
                                                  window_px, reach_px, close_px, fields,
                                                  std::make_shared<const RayGrid>(camera.lens)});
  }
};

DenseMapper::DenseMapper(const Pattern& pattern, const Calibration& calibration, std::size_t camera_index,
                         const DecodeOptions& decode)
    : DenseMapper([&] {
        const CalibratedCamera& camera = calibration.cameras[camera_index];
        const ExpectedFrames expected(camera, calibration.projector, decode.middle_depth_mm());
        const double pitch = pattern.pitch_px() * static_cast<double>(expected.in_the_middle().scale);
        return std::shared_ptr<const Fixed>(
            new Fixed{PatchGeometry(camera, calibration.projector), decode, pattern.letters(),
                      slsd::window_px(pitch, stride_px(camera.lens, decode.dense)), judge_reach_px(pitch),
                      slsd::close_px(pitch), std::make_shared<const PatternFields>(draw_pattern(pattern)),
                      std::make_shared<const RayGrid>(camera.lens)});
      }()) {}

DenseMapper::DenseMapper(std::shared_ptr<const Fixed> fixed)
    : fixed_(std::move(fixed)),
      grid_(fixed_->geometry, {stride_px(fixed_->geometry.camera.lens, fixed_->decode.dense), fixed_->window_px,
                               fixed_->decode.depth_min_mm, fixed_->decode.depth_max_mm}),
      refiner_(grid_),
      search_(fixed_->letters, fixed_->window_px),
      follower_(refiner_.window_px()),
      judge_({fixed_->reach_px, fixed_->window_px, fixed_->decode.depth_min_mm, fixed_->decode.depth_max_mm}),
      occlusion_(fixed_->geometry.camera, fixed_->geometry.projector, fixed_->rays) {}

DenseMapper DenseMapper::another() const {
  DenseMapper other(fixed_);
  other.follower_ = follower_.another();
  return other;
}

const std::shared_ptr<const RayGrid>& DenseMapper::rays() const {
  return fixed_->rays;
}

int DenseMapper::window_px() const {
  return fixed_->window_px;
}

std::size_t DenseMapper::bytes() const {
  return grid_.bytes() + refiner_.bytes() + follower_.bytes() + occlusion_.bytes() + cleaner_.bytes() + map_.bytes() +
         (of_part_ ? of_part_->bytes() : 0);
}

std::size_t DenseMapper::bytes_of_fields(const Lens& projector) {
  const auto samples = [](int px) {
    return static_cast<std::size_t>(px + 2 * PatternField::kBorderPx) * PatternField::kSamplesPerPx;
  };
  return (PatternFields::kLadderPx.size() / 2 + PatternFields::kKept) * samples(projector.width_px) *
         samples(projector.height_px) * sizeof(std::uint32_t);
}

int DenseMapper::stride_px(const Lens& camera, const DenseOptions& options) {
  int stride = options.stride_px;
  const auto nodes = [&] {
    return static_cast<std::size_t>(camera.width_px / stride + 1) *
           static_cast<std::size_t>(camera.height_px / stride + 1);
  };
  while (nodes() > kNodesMost) ++stride;
  return stride;
}

void DenseMapper::warm_up() {
  (void)fixed_->fields->usual();
}

/// Computes the plane of each symbol: its depth, and the slopes that make the patch map match the grid of symbols.
void DenseMapper::find_seeds(const DecodedSymbols& symbols, Executor& executor) {
  const std::vector<LatticeSymbol>& all = symbols.lattice->symbols;
  const auto is_in_range = [&](double depth_mm) {
    return depth_mm >= fixed_->decode.depth_min_mm && depth_mm <= fixed_->decode.depth_max_mm;
  };
  seeds_.resize(all.size());
  executor.run_ranges(all.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) {
      const double depth_mm = symbols.depths_mm[i];
      if (!is_in_range(depth_mm)) continue;
      const PatchGeometry& geometry = fixed_->geometry;
      const PatchMap map = make_patch_map(symbols.rays[i], all[i].centre_px.cast<double>(),
                                          geometry.camera.projector_from_camera, geometry.projector, depth_mm);
      const Eigen::Vector2f at = map.base.topRightCorner<2, 1>();
      const Eigen::Matrix2f flat = map.base.topLeftCorner<2, 2>() - at * map.base.bottomLeftCorner<1, 2>();
      const Eigen::RowVector2f slopes = map.along.transpose() * (all[i].frame.inverse() - flat);
      const auto per_px = static_cast<float>(map.inverse_depth_per_px);
      seeds_[i] = {all[i].centre_px, {static_cast<float>(1 / depth_mm), slopes.x() * per_px, slopes.y() * per_px}};
    }
  });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (is_in_range(symbols.depths_mm[i])) seeds_[kept++] = seeds_[i];
  seeds_.resize(kept);
}

/// The light of a frame's pixels, by the present tone curve.
DenseFrame DenseMapper::develop(const DenseFrame& frame) {
  if (tone_.is_straight()) return frame;
  const GreyView light = tone_.light_of(frame.pixels, frame.full).view();
  return {light, ToneCurve::kFull, measure_noise(light, ToneCurve::kFull), tone_.power()};
}

/// Finds the frame's offset from its epipolar lines, its blur, and the camera's tone curve. Each looks like a part of
/// the others, so it estimates them in turn.
/// @return the light of the frame
DenseFrame DenseMapper::find_pattern(const DenseFrame& frame, Executor& executor) {
  DenseFrame light = frame;
  bool again = false;
  const auto look = [&](const BlurredPattern& tried) {
    grid_.find_epipolar_offset(light, tried, seeds_, std::exchange(again, true), executor);
    return grid_.look_at_blur(light, tried, seeds_, executor);
  };
  const float blur_px = find_blur_and_tone(
      *fixed_->fields, tone_, [&] { light = develop(frame); },
      [&](const PatternField& even) { return look(BlurredPattern(even)); });
  pattern_ = slsd::find_pattern(*fixed_->fields, blur_px, look, [&] { return grid_.blur_samples(); });
  return light;
}

void DenseMapper::set_part(const std::optional<PixelRectangle>& part) {
  part_ = part;
  if (!part || part->empty()) return;
  const Lens& lens = fixed_->geometry.camera.lens;
  const int stride = grid_.stride_px(), coarse = refiner_.lattice().step * stride;
  // A pixel's point depends on the nodes in its surroundings, on those fused with them twice, and on the coarse nodes
  // around these. The coarse nodes and the rays of the part are those of the whole frame.
  const int reach = fixed_->reach_px + 2 * SurfaceGrid::kFuseReach * stride + coarse + refiner_.window_px() / 2;
  const int unit = std::max(1, std::lcm(coarse, RayGrid::kPitchPx));
  PixelRectangle around = part->widened(reach, lens);
  around.left -= around.left % unit, around.top -= around.top % unit;
  if (of_part_ && around == around_part_) return;
  around_part_ = around;
  of_part_.reset(new DenseMapper(fixed_->of_part(around, stride)));
}

std::optional<PixelRectangle> DenseMapper::part_of_symbols() const {
  return part_ && !part_->empty() ? around_part_ : part_;
}

/// Measures the surface from the seeds, in a frame whose blur, offset and tone curve are known.
/// @param within  pixels that matter
/// @param from    the previous frame of a stream; null if there is none
void DenseMapper::map_surface(const DenseFrame& seen, const PixelRectangle& within, const FollowedFrame* from,
                              bool next, Executor& executor, DenseObserver* observer) {
  const auto done = [&](DenseStage stage) {
    if (observer != nullptr) observer->stage_done(stage);
  };
  map_.resize(fixed_->geometry.camera.lens.width_px, fixed_->geometry.camera.lens.height_px);
  if (refiner_.lattice().step > 1) {
    grid_.grow_coarse(seen, pattern_, seeds_, refiner_.lattice(), executor);
    refiner_.refine(seen, pattern_, grid_, executor);
  }
  grid_.grow(seen, pattern_, seeds_, executor);
  done(DenseStage::kGrow);
  const auto of_symbols = static_cast<std::ptrdiff_t>(seeds_.size());
  if (from != nullptr) seeds_.insert(seeds_.end(), from->found.begin(), from->found.end());
  if (const auto found = search_.find(seen, pattern_.usual(), grid_, executor); !found.empty()) {
    grid_.grow_on(seen, pattern_, found, executor);
    seeds_.insert(seeds_.end(), found.begin(), found.end());
  }
  if (next) follower_.keep(seen, pattern_, grid_, std::span(seeds_).subspan(of_symbols), executor);
  done(DenseStage::kSearch);
  grid_.fuse(executor);
  done(DenseStage::kFuse);
  judge_.judge(seen, pattern_, grid_, map_, within, executor);
  done(DenseStage::kJudge);
  occlusion_.drop_occluded(map_, executor);
  cleaner_.drop_unlit_boundaries(map_, fixed_->close_px, executor);
  const std::size_t patch = static_cast<std::size_t>(fixed_->window_px) * fixed_->window_px;
  cleaner_.drop_small_components(map_, patch, seeds_, executor);
  cleaner_.prune(map_, fixed_->decode.dense.prune_px, patch, executor);
  occlusion_.drop_beyond_the_light(map_);
  if (!tone_.is_straight()) {
    const auto levels = tone_.levels_of_lights();
    for (std::uint8_t& intensity : map_.intensity) intensity = levels[intensity];
  }
  map_.count_pixels();
}

/// Measures the part as the whole frame of another camera.
void DenseMapper::map_part(const DenseFrame& seen, Executor& executor, DenseObserver* observer) {
  const PixelRectangle& around = around_part_;
  const Eigen::Vector2f first(static_cast<float>(around.left), static_cast<float>(around.top));
  DenseMapper& mapper = *of_part_;
  mapper.seeds_.clear();
  for (const SurfaceSeed& seed : seeds_)
    if (around.contains(static_cast<int>(seed.camera_px.x()), static_cast<int>(seed.camera_px.y())))
      mapper.seeds_.push_back({seed.camera_px - first, seed.plane});
  mapper.pattern_ = pattern_;
  mapper.pattern_.move_origin(first);
  mapper.tone_.set_power(tone_.power());
  EpipolarOffset offset = grid_.epipolar_offset();
  offset.middle_px -= first;
  mapper.grid_.clear();
  mapper.grid_.set_epipolar_offset(offset);
  DenseFrame cropped = seen;
  cropped.pixels = around.crop(seen.pixels);
  const int judged = 2 * fixed_->close_px + static_cast<int>(std::ceil(fixed_->decode.dense.prune_px));
  const PixelRectangle within{part_->left - around.left - judged, part_->top - around.top - judged,
                              part_->right - around.left + judged, part_->bottom - around.top + judged};
  mapper.map_surface(cropped, within, nullptr, false, executor, observer);
  map_.take_part(mapper.map_, around.left, around.top, *part_, fixed_->geometry.camera.lens.width_px,
                 fixed_->geometry.camera.lens.height_px);
}

DenseMap& DenseMapper::measure(const GreyView& frame, double full, const DecodedSymbols& symbols, Executor& executor,
                               DenseObserver* observer, bool next) {
  if (part_ && part_->empty()) {
    const Lens& lens = fixed_->geometry.camera.lens;
    map_.take_part({}, 0, 0, *part_, lens.width_px, lens.height_px);
    return map_;
  }
  const DenseFrame taken{frame, full, symbols.noise};
  next = next && !part_;
  find_seeds(symbols, executor);
  tone_.set_power(next ? follower_.tone_power() : 1);
  DenseFrame seen = develop(taken);
  const auto from = next ? follower_.follow(seen, grid_, executor) : nullptr;
  followed_ = from ? follower_.followed() : 0, across_px_ = from ? follower_.across_px() : 0;
  if (from) {
    pattern_ = from->pattern;
    grid_.set_epipolar_offset(from->epipolar);
  } else {
    if (!part_) grid_.clear();
    seen = find_pattern(taken, executor);
  }
  if (observer != nullptr) observer->stage_done(DenseStage::kFindBlur);
  if (part_) {
    map_part(seen, executor, observer);
  } else {
    map_surface(seen, {0, 0, fixed_->geometry.camera.lens.width_px, fixed_->geometry.camera.lens.height_px}, from.get(),
                next, executor, observer);
  }
  if (next) follower_.finish(map_, grid_);
  if (observer != nullptr) observer->stage_done(DenseStage::kClean);
  return map_;
}

}  // namespace slsd
