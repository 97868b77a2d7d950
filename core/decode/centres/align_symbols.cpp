// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/align_symbols.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

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
float variance_of_noise(const PatchFit& fit) {
  return fit.covariance(0, 0) * fit.residual * fit.residual;
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

SymbolAligner::Patch SymbolAligner::patch_of(const LatticeSymbol& symbol, const PixelRay& ray, double depth_mm) const {
  Patch patch{};
  patch.level = symbol.background + 0.5F * symbol.gain;
  patch.map = make_patch_map(ray, symbol.centre_px.cast<double>(), camera_.projector_from_camera, projector_, depth_mm);
  const PatchMap& map = patch.map;
  // Slopes that make the patch map match the symbol's local frame.
  const Eigen::Matrix2f inverse = symbol.frame.inverse();
  const Eigen::Vector2f at = map.base.topRightCorner<2, 1>();
  const Eigen::Matrix2f flat = map.base.topLeftCorner<2, 2>() - at * map.base.bottomLeftCorner<1, 2>();
  const Eigen::RowVector2f slopes = map.along.transpose() * (inverse - flat);
  PatchState& start = patch.start;
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
  const Eigen::Vector2f middle = symbol.centre_px + camera_offset(map, start, square - map.origin_px.cast<float>());
  const Eigen::Vector2f reach = half_px_ * symbol.frame.cwiseAbs().rowwise().sum() + Eigen::Vector2f::Constant(1);
  patch.window = {static_cast<int>(std::floor(middle.x() - reach.x())),
                  static_cast<int>(std::floor(middle.y() - reach.y())),
                  static_cast<int>(std::ceil(2 * reach.x())) + 1,
                  static_cast<int>(std::ceil(2 * reach.y())) + 1,
                  square,
                  half_px_};
  return patch;
}

PatchFit SymbolAligner::fit(const GreyView& frame, double full, const FrameNoise& noise, const Patch& patch,
                            const PatchState& start, std::size_t blur) {
  return std::visit(
      [&](const auto& view) {
        return aligner_.align(view, full, noise.at(patch.level), fields_->at(blur), patch.map, patch.window, start);
      },
      frame);
}

/// Finds the blur that fits a sample of the symbols best, downhill from the middle of the available blurs.
std::size_t SymbolAligner::find_blur(const GreyView& frame, double full, const FrameNoise& noise) {
  constexpr std::size_t kUnknown = std::numeric_limits<std::size_t>::max();
  const std::size_t step = std::max<std::size_t>(1, patches_.size() / kBlurSamples);
  std::array<float, PatternFields::kBlursPx.size()> misfit;
  misfit.fill(-1);
  const auto misfit_at = [&](std::size_t blur) {
    if (misfit[blur] >= 0) return misfit[blur];
    misfits_.clear();
    for (std::size_t i = step / 2; i < patches_.size(); i += step) {
      const PatchFit fitted = fit(frame, full, noise, patches_[i], patches_[i].start, blur);
      misfits_.push_back(fitted.solved ? fitted.residual / fitted.state.gain : 1);
    }
    const auto middle = misfits_.begin() + static_cast<std::ptrdiff_t>(misfits_.size() / 2);
    std::nth_element(misfits_.begin(), middle, misfits_.end());
    return misfit[blur] = *middle;
  };
  std::size_t best = 1;
  for (std::size_t from = kUnknown; from != best;) {
    from = best;
    if (from + 1 < misfit.size() && misfit_at(from + 1) < misfit_at(best)) best = from + 1;
    if (from > 0 && misfit_at(from - 1) < misfit_at(best)) best = from - 1;
  }
  return best;
}

/// Tries the planes of the neighbours as starts. If part of a symbol is cut off, many planes nearly fit the rest; its
/// neighbours' planes are better starts.
void SymbolAligner::try_neighbours(const GreyView& frame, double full, const FrameNoise& noise, const Lattice& lattice,
                                   std::size_t index, std::size_t blur) {
  Patch& patch = patches_[index];
  for (const std::int32_t other : lattice.symbols[index].neighbours) {
    if (other < 0) continue;
    const Patch& beside = patches_[static_cast<std::size_t>(other)];
    if (!beside.fit.solved || beside.fit.support < kSupportWeak) continue;
    const PatchState start = continued(beside.map, beside.fit.state, patch.map, patch.fit.state);
    if (std::abs(start.disparity) > 2) continue;
    const PatchFit again = fit(frame, full, noise, patch, start, blur);
    if (again.solved && again.support > patch.fit.support + 0.005F) patch.fit = again;
  }
}

/// Median distance of a patch from its neighbours' planes, continued to it, projector px, less the part that noise
/// explains.
float SymbolAligner::disagreement_px(const Lattice& lattice, std::size_t index) const {
  const Patch& own = patches_[index];
  std::array<float, 4> off;
  off.fill(std::numeric_limits<float>::max());
  int count = 0;
  float noise = 0;
  for (const std::int32_t other : lattice.symbols[index].neighbours) {
    if (other < 0 || !patches_[static_cast<std::size_t>(other)].fit.solved) continue;
    const Patch& beside = patches_[static_cast<std::size_t>(other)];
    const PatchState there = continued(beside.map, beside.fit.state, own.map, own.fit.state);
    off[count++] = std::abs(own.fit.state.disparity - there.disparity);
    const float squared_px = (own.map.middle_px - beside.map.middle_px).squaredNorm();
    noise += variance_of_noise(own.fit) + variance_of_noise(beside.fit) +
             0.5F * (beside.fit.covariance(1, 1) + beside.fit.covariance(2, 2)) * beside.fit.residual *
                 beside.fit.residual * squared_px;
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
  const auto& [map, window, start, fit, level] = patches_[index];
  const PatchState& state = fit.state;
  const Eigen::Vector2f off = camera_offset(map, state, projector_px - map.origin_px.cast<float>());
  const double inverse = inverse_depth(map, state, off);
  const Eigen::Vector3d direction = (ray.direction + ray.turn * off.cast<double>()).homogeneous();
  AlignedSymbol aligned;
  aligned.point_in_camera = direction / inverse;
  aligned.centre_px = map.middle_px + off;
  aligned.whole = fit.solved && fit.support > kWholeSupportMin;
  const Eigen::Vector3f by(1, off.x(), off.y());
  const float noise = by.dot(fit.covariance.topLeftCorner<3, 3>() * by) * fit.residual * fit.residual;
  const auto square = [](float x) { return x * x; };
  const float shading = std::hypot(state.gain_x, state.gain_y) / state.gain;
  const float sigma_px =
      std::sqrt(square(kSamplingPx) + square(aligned_sigma_px(noise, fit.scatter, fit.support)) +
                square(kOfDisagreement * disagreement_px(lattice, index)) + square(kOfShading * shading));
  aligned.sigma_mm = static_cast<float>(map.inverse_depth_per_px / (inverse * inverse) * direction.norm() * sigma_px);
  return aligned;
}

const std::vector<AlignedSymbol>& SymbolAligner::align(const GreyView& frame, double full, const FrameNoise& noise,
                                                       const Lattice& lattice, std::span<const PixelRay> rays,
                                                       std::span<const double> depths_mm, const CellRays& cells) {
  patches_.clear();
  aligned_.clear();
  for (std::size_t i = 0; i < lattice.symbols.size(); ++i)
    patches_.push_back(patch_of(lattice.symbols[i], rays[i], depths_mm[i]));
  if (patches_.empty()) return aligned_;
  const std::size_t blur = find_blur(frame, full, noise);
  for (Patch& patch : patches_) patch.fit = fit(frame, full, noise, patch, patch.start, blur);
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    if (patches_[i].fit.solved && patches_[i].fit.support < kSupportWeak)
      try_neighbours(frame, full, noise, lattice, i, blur);
  }
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    const LatticeSymbol& symbol = lattice.symbols[i];
    aligned_.push_back(point_of(lattice, i, rays[i], cells.pixel(symbol.row, symbol.column).cast<float>()));
  }
  return aligned_;
}

}  // namespace slsd
