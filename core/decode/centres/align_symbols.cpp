// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/align_symbols.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace slsd {
namespace {

/// Width of a patch's border beyond its cell, projector px: the neighbours' edges help to place it.
constexpr float kBeyondCellPx = 1.5F;
/// Share of the patch that agrees with the pattern. Below it, the aligner also tries the planes of the neighbours.
constexpr float kSupportWeak = 0.94F;
/// Further errors of a patch's position, fitted as for aligned_sigma_px: see AlignedSymbol::sigma_mm.
constexpr float kSamplingPx = 0.002F;     // sampling of the pattern, projector px
constexpr float kOfDisagreement = 0.17F;  // factor of the disagreement with the neighbours' planes
constexpr float kOfShading = 0.5F;        // factor of the relative change of the light for one px

/// Smallest number of symbols from which the frame's blur is measured.
constexpr std::size_t kBlurSamples = 40;

/// The inverse depth of a patch's plane at a camera pixel, given from the patch's centre.
double inverse_depth(const PatchMap& map, const PatchState& state, const Eigen::Vector2f& at) {
  const float disparity = state.disparity + state.slope_x * at.x() + state.slope_y * at.y() +
                          0.5F * (state.bend_xx * at.x() * at.x() + state.bend_yy * at.y() * at.y()) +
                          state.bend_xy * at.x() * at.y();
  return map.reference_inverse_depth + disparity * map.inverse_depth_per_px;
}

/// Variance of the disparity at the patch's centre, from the remaining residual.
float variance_of_noise(const CellTask& cell) {
  return cell.covariance(0, 0) * cell.patch.residual * cell.patch.residual;
}

/// The ray of a pixel near the one whose ray this is.
PixelRay ray_beside(const PixelRay& ray, const Eigen::Vector2d& off_px) {
  return {ray.direction + ray.turn * off_px, ray.turn};
}

/// A neighbour's plane as the starting point of this patch.
PatchState continued(const PatchMap& from_map, const PatchState& from, const PatchMap& map, const PatchState& light) {
  const Eigen::Vector2f at = map.middle_px - from_map.middle_px;
  const auto unit = static_cast<float>(from_map.inverse_depth_per_px / map.inverse_depth_per_px);
  PatchState start = light;
  start.disparity =
      static_cast<float>((inverse_depth(from_map, from, at) - map.reference_inverse_depth) / map.inverse_depth_per_px);
  start.slope_x = unit * (from.slope_x + from.bend_xx * at.x() + from.bend_xy * at.y());
  start.slope_y = unit * (from.slope_y + from.bend_xy * at.x() + from.bend_yy * at.y());
  start.bend_xx = unit * from.bend_xx, start.bend_xy = unit * from.bend_xy, start.bend_yy = unit * from.bend_yy;
  start.across = from.across;
  return start;
}

}  // namespace

float aligned_sigma_px(float variance, float scatter, float support) {
  constexpr float kOfVariance = 1.1F, kOfScatter = 1.2F;
  constexpr float kOfLack = 0.11F;        // px for a pattern that disagrees completely
  constexpr float kSupportUsual = 0.95F;  // noise alone leaves this support
  const auto square = [](float x) { return x * x; };
  return std::sqrt(square(kOfVariance) * variance + square(kOfScatter * scatter) +
                   square(kOfLack * std::max(0.F, kSupportUsual - support)));
}

SymbolAligner::SymbolAligner(const Pattern& pattern, const CalibratedCamera& camera, const Lens& projector)
    : camera_(camera),
      projector_(projector),
      options_(pattern.options),
      pitch_px_(static_cast<float>(pattern.pitch_px())),
      half_px_(0.5F * pitch_px_ + kBeyondCellPx),
      fields_(std::make_shared<const PatternFields>(draw_pattern(pattern))) {}

CellTask SymbolAligner::cell_of(const LatticeSymbol& symbol, const PixelRay& ray, double depth_mm) const {
  CellTask cell;
  PatchTask& patch = cell.patch;
  patch.x = static_cast<int>(std::lround(symbol.centre_px.x()));
  patch.y = static_cast<int>(std::lround(symbol.centre_px.y()));
  const Eigen::Vector2d middle_px(patch.x, patch.y);
  patch.map = make_patch_map(ray_beside(ray, middle_px - symbol.centre_px.cast<double>()), middle_px,
                             camera_.projector_from_camera, projector_, depth_mm);
  const PatchMap& map = patch.map;
  // Slopes that make the patch map match the symbol's local frame.
  const Eigen::Matrix2f inverse = symbol.frame.inverse();
  const Eigen::Vector2f at = map.base.topRightCorner<2, 1>();
  const Eigen::Matrix2f flat = map.base.topLeftCorner<2, 2>() - at * map.base.bottomLeftCorner<1, 2>();
  const Eigen::RowVector2f slopes = map.along.transpose() * (inverse - flat);
  PatchState& start = patch.state;
  start.slope_x = slopes.x(), start.slope_y = slopes.y();
  // The map from the pattern to the camera bends. The disparity bends with it, less the part that perspective gives a
  // plane.
  const Bend& bend = symbol.bend;
  if (!bend.uu.isZero() || !bend.uv.isZero() || !bend.vv.isZero()) {
    const Eigen::RowVector2f along = map.along.transpose() * inverse,
                             depth = map.base.bottomLeftCorner<1, 2>() + map.shift.z() * slopes;
    const auto second = [&](int a, int b) {
      const Eigen::Vector2f p = inverse.col(a), q = inverse.col(b);
      const Eigen::Vector2f bent =
          bend.uu * (p.x() * q.x()) + bend.uv * (p.x() * q.y() + p.y() * q.x()) + bend.vv * (p.y() * q.y());
      return -along.dot(bent) + along[a] * depth[b] + along[b] * depth[a];
    };
    start.bend_xx = second(0, 0), start.bend_xy = second(0, 1), start.bend_yy = second(1, 1);
  }
  const float left = static_cast<float>(symbol.column) * pitch_px_ + static_cast<float>(options_.spacing_px / 2),
              top = static_cast<float>(symbol.row) * pitch_px_ + static_cast<float>(options_.spacing_px / 2);
  const float half_symbol = 0.5F * static_cast<float>(options_.symbol_size_px - 1);
  const Eigen::Vector2f square(left + half_symbol, top + half_symbol);
  cell.square_middle_px = square, cell.square_half_px = half_px_;
  const Eigen::Vector2f middle = camera_offset(map, start, square - map.origin_px.cast<float>());
  const Eigen::Vector2f reach = half_px_ * symbol.frame.cwiseAbs().rowwise().sum() + Eigen::Vector2f::Constant(1);
  cell.window_px = 2 * static_cast<int>(std::ceil((middle.cwiseAbs() + reach).maxCoeff())) + 1;
  return cell;
}

/// The light of a frame's pixels, by the present tone curve. Sets the cells' noise in it.
SymbolAligner::Developed SymbolAligner::develop(const Developed& frame, const FrameNoise& noise,
                                                const Lattice& lattice) {
  Developed light = frame;
  FrameNoise noise_there = noise;
  if (!tone_.is_straight()) {
    light = {tone_.light_of(frame.pixels, frame.full).view(), ToneCurve::kFull};
    noise_there = measure_noise(light.pixels, light.full);
  }
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const LatticeSymbol& symbol = lattice.symbols[i];
    const float between = symbol.background + 0.5F * symbol.gain;  // midway between dark and lit
    cells_[i].patch.noise = noise_there.at(tone_.is_straight() ? between : tone_.light_of(between, frame.full));
  }
  return light;
}

/// Aligns cells, each with the field of its blur.
void SymbolAligner::align_by_blur(const Developed& light, const BlurredPattern& pattern, std::span<CellTask> cells) {
  if (pattern.levels() == 1) return align_cells(light.pixels, light.full, pattern.usual(), {}, cells);
  for (int level = 0; level < pattern.levels(); ++level) {
    const auto is_of_level = [&](const CellTask& cell) {
      const PatchMap& map = cell.patch.map;
      return pattern.level_at(map.middle_px, static_cast<float>(map.reference_inverse_depth)) == level;
    };
    of_blur_.clear();
    std::ranges::copy_if(cells, std::back_inserter(of_blur_), is_of_level);
    align_cells(light.pixels, light.full, pattern.field(level), {}, of_blur_);
    auto aligned = of_blur_.begin();
    for (CellTask& cell : cells)
      if (is_of_level(cell)) cell = *aligned++;
  }
}

/// Aligns a sample of the symbols with the pattern, and measures their blur.
BlurSeen SymbolAligner::look_at_blur(const Developed& light, const BlurredPattern& pattern) {
  const std::size_t step = std::max<std::size_t>(1, cells_.size() / kBlurSamples);
  sample_.clear(), blur_meter_.clear(), blur_samples_.clear();
  for (std::size_t i = step / 2; i < cells_.size(); i += step) sample_.push_back(cells_[i]);
  align_by_blur(light, pattern, sample_);
  BlurSeen seen{.tried = sample_.size()};
  for (const CellTask& cell : sample_) {
    if (cell.patch.failed || cell.patch.support < kWholeSupportMin) continue;
    ++seen.aligned;
    const PatchMap& map = cell.patch.map;
    const auto inverse_depth = static_cast<float>(map.reference_inverse_depth);
    const PatternField& field = pattern.field(pattern.level_at(map.middle_px, inverse_depth));
    const auto blur = blur_of_patch(light.pixels, light.full, field, {}, cell);
    if (!blur) continue;
    blur_meter_.add(*blur);
    blur_samples_.push_back({map.middle_px, inverse_depth, blur->variance});
  }
  seen.blur_px = changed_blur_px(pattern.usual().blur_sigma_px(), blur_meter_.change().value_or(0));
  seen.tone_change = blur_meter_.tone_change().value_or(0);
  return seen;
}

/// Tries the planes of the neighbours as starts. If part of a symbol is cut off, many planes nearly fit the rest; its
/// neighbours' planes are better starts.
void SymbolAligner::try_neighbours(const Developed& light, const BlurredPattern& pattern, const Lattice& lattice) {
  const auto is_good = [](const PatchTask& patch) { return !patch.failed && patch.support >= kSupportWeak; };
  again_.clear(), again_for_.clear();
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const PatchTask& patch = cells_[i].patch;
    if (patch.failed || is_good(patch)) continue;
    for (const std::int32_t other : lattice.symbols[i].neighbours) {
      if (other < 0 || !is_good(cells_[static_cast<std::size_t>(other)].patch)) continue;
      const PatchTask& beside = cells_[static_cast<std::size_t>(other)].patch;
      const PatchState start = continued(beside.map, beside.state, patch.map, patch.state);
      if (std::abs(start.disparity) > 2) continue;
      again_.push_back(cells_[i]), again_for_.push_back(i);
      again_.back().patch.state = start;
    }
  }
  align_by_blur(light, pattern, again_);
  for (std::size_t k = 0; k < again_.size(); ++k) {
    CellTask& cell = cells_[again_for_[k]];
    if (!again_[k].patch.failed && again_[k].patch.support > cell.patch.support + 0.005F) cell = again_[k];
  }
}

/// Median distance of a patch from its neighbours' planes, continued to it, projector px, less the part that noise
/// explains.
float SymbolAligner::disagreement_px(const Lattice& lattice, std::size_t index) const {
  const CellTask& own = cells_[index];
  std::array<float, 4> off;
  off.fill(std::numeric_limits<float>::max());
  int count = 0;
  float noise = 0;
  for (const std::int32_t other : lattice.symbols[index].neighbours) {
    if (other < 0 || cells_[static_cast<std::size_t>(other)].patch.failed) continue;
    const CellTask& beside = cells_[static_cast<std::size_t>(other)];
    const PatchTask &here = own.patch, &there = beside.patch;
    off[count++] = std::abs(here.state.disparity - continued(there.map, there.state, here.map, here.state).disparity);
    const float squared_px = (here.map.middle_px - there.map.middle_px).squaredNorm();
    noise += variance_of_noise(own) + variance_of_noise(beside) +
             0.5F * (beside.covariance(1, 1) + beside.covariance(2, 2)) * there.residual * there.residual * squared_px;
  }
  if (count == 0) return 0;
  std::sort(off.begin(), off.end());
  const float median = 0.5F * (off[(count - 1) / 2] + off[count / 2]);
  constexpr float kMedianOfNormal = 0.6745F;
  return std::sqrt(
      std::max(0.F, median * median - kMedianOfNormal * kMedianOfNormal * noise / static_cast<float>(count)));
}

AlignedSymbol SymbolAligner::point_of(const Lattice& lattice, std::size_t index, const PixelRay& ray,
                                      const Eigen::Vector2f& projector_px) const {
  const CellTask& cell = cells_[index];
  const PatchTask& patch = cell.patch;
  const PatchMap& map = patch.map;
  const PatchState& state = patch.state;
  const Eigen::Vector2f off = camera_offset(map, state, projector_px - map.origin_px.cast<float>());
  const double inverse = inverse_depth(map, state, off);
  AlignedSymbol aligned;
  aligned.centre_px = map.middle_px + off;
  const Eigen::Vector2d off_centre = (aligned.centre_px - lattice.symbols[index].centre_px).cast<double>();
  const Eigen::Vector3d direction = ray_beside(ray, off_centre).direction.homogeneous();
  aligned.point_in_camera = direction / inverse;
  aligned.whole = !patch.failed && patch.support > kWholeSupportMin;
  const Eigen::Vector3f by(1, off.x(), off.y());
  const float noise = by.dot(cell.covariance * by) * patch.residual * patch.residual;
  const auto square = [](float x) { return x * x; };
  const float shading = std::hypot(state.gain_x, state.gain_y) / state.gain;
  const float sigma_px =
      std::sqrt(square(kSamplingPx) + square(aligned_sigma_px(noise, patch.scatter, patch.support)) +
                square(kOfDisagreement * disagreement_px(lattice, index)) + square(kOfShading * shading));
  aligned.sigma_mm = static_cast<float>(map.inverse_depth_per_px / (inverse * inverse) * direction.norm() * sigma_px);
  return aligned;
}

const std::vector<AlignedSymbol>& SymbolAligner::align(const GreyView& frame, double full, const FrameNoise& noise,
                                                       const Lattice& lattice, std::span<const PixelRay> rays,
                                                       std::span<const double> depths_mm, const CellRays& cells) {
  cells_.clear();
  aligned_.clear();
  for (std::size_t i = 0; i < lattice.symbols.size(); ++i)
    cells_.push_back(cell_of(lattice.symbols[i], rays[i], depths_mm[i]));
  if (cells_.empty()) return aligned_;
  Developed light{frame, full};
  const auto look = [&](const BlurredPattern& tried) { return look_at_blur(light, tried); };
  const float blur_px = find_blur_and_tone(
      *fields_, tone_,
      [&] {
        light = develop({frame, full}, noise, lattice);
      },
      [&](const PatternField& even) { return look(BlurredPattern(even)); });
  const BlurredPattern pattern =
      find_pattern(*fields_, blur_px, look, [&] { return std::span<const BlurSample>(blur_samples_); });
  align_by_blur(light, pattern, cells_);
  try_neighbours(light, pattern, lattice);
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const LatticeSymbol& symbol = lattice.symbols[i];
    aligned_.push_back(point_of(lattice, i, rays[i], cells.pixel(symbol.row, symbol.column).cast<float>()));
  }
  return aligned_;
}

}  // namespace slsd
