// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/appearance/align_patch.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "core/clones.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

using BitLanes [[gnu::vector_size(32)]] = std::uint32_t;

constexpr float kNotCounted = -1;  // marks a patch's pixels that are saturated or outside

Eigen::Vector2f across_of(const PatchMap& map) {
  return {-map.along.y(), map.along.x()};
}

/// The coefficients of q in a window, row by row: q_k = constant + x + y + (xx + 2 xy + yy) / 2.
struct Warp {
  float constant[3], x[3], y[3], xx[3], xy[3], yy[3];
  float across_u, across_v;  // added to p
  float along_u, along_v;
};

/// Inputs of one pass over the patch, in plain numbers.
struct Pass {
  Warp warp;
  const float* patch;
  int stride, height;
  float first_x, first_y;                                  // position of the first pixel, from the window's centre
  float third_left, third_right, third_top, third_bottom;  // boundaries of the ninths
  float middle_u, middle_v, half;
  const std::uint32_t* samples;
  int field_width, field_height;
  float origin_u, origin_v;  // origin of p, in samples
  float slope_unit;
  float level;  // subtracted from every pixel: sums of small numbers keep their precision
  // Result of the last step, from which outliers are down-weighted; per_scale 0: all pixels count fully.
  float gain, gain_x, gain_y, offset, per_scale;
};

/// g is the pattern's slope along the epipolar line, c that across it, p its value, i the pixel; w is for pixels alone.
/// Sums with x and y are indexed by [power of x + y]: 1, x, y, xx, xy, yy.
struct Sums {
  float gg[6], gp[6], pp[6];
  float g[3], p[3], gc[3], pc[3], ig[3], ip[3];
  float w, c, cc, ic, i, ii;
  float pixels;                  ///< pixels in the square, down-weighted or not
  float part_gr[9], part_gg[9];  ///< g times the residual, and g squared, of the window's ninths
};

enum RowSum {
  kGG,
  kGP = 3,
  kPP = 6,
  kG = 9,
  kP = 11,
  kGC = 13,
  kPC = 15,
  kIG = 17,
  kIP = 19,
  kW = 21,
  kC,
  kCC,
  kIC,
  kI,
  kII,
  kPixels,
  kGR,
  kGRLeft,
  kGRRight,
  kGGLeft,
  kGGRight,
  kRowSums
};

inline __attribute__((always_inline)) void sum_patch(const Pass& pass, Sums& sums) {
  const Warp& warp = pass.warp;
  const Lanes zero{}, one = zero + 1;
  Lanes total[kRowSums], gg_y{}, gg_xy{}, gg_yy{}, gp_y{}, gp_xy{}, gp_yy{}, pp_y{}, pp_xy{}, pp_yy{}, g_y{}, p_y{},
      gc_y{}, pc_y{}, ig_y{}, ip_y{};
  for (Lanes& sum : total) sum = zero;
  Lanes parts[3][6];
  for (auto& row : parts)
    for (Lanes& part : row) part = zero;
  const float last_column = static_cast<float>(pass.field_width - 1),
              last_row = static_cast<float>(pass.field_height - 1);
  for (int row = 0; row < pass.height; ++row) {
    const float y = pass.first_y + static_cast<float>(row);
    float constant[3], linear[3];
    for (int k = 0; k < 3; ++k) {
      constant[k] = warp.constant[k] + y * (warp.y[k] + 0.5F * y * warp.yy[k]);
      linear[k] = warp.x[k] + y * warp.xy[k];
    }
    Lanes sum[kRowSums];
    for (Lanes& part : sum) part = zero;
    for (int left = 0; left < pass.stride; left += kLanes) {
      Lanes i;
      load(pass.patch + row * pass.stride + left, i);
      const Lanes x = kLane + (pass.first_x + static_cast<float>(left));
      const Lanes half_x = 0.5F * x;
      const Lanes q0 = constant[0] + x * (linear[0] + half_x * warp.xx[0]);
      const Lanes q1 = constant[1] + x * (linear[1] + half_x * warp.xx[1]);
      const Lanes q2 = constant[2] + x * (linear[2] + half_x * warp.xx[2]);
      const Lanes per_q2 = one / q2;
      const Lanes u = q0 * per_q2 + warp.across_u, v = q1 * per_q2 + warp.across_v;
      const Lanes off_u = u - pass.middle_u, off_v = v - pass.middle_v;
      const Lanes far_u = off_u > zero ? off_u : -off_u, far_v = off_v > zero ? off_v : -off_v;
      Lanes inside = pass.half - (far_u > far_v ? far_u : far_v);
      inside = inside < one ? inside : one;
      const Lanes counted = ((inside > zero) & (i >= zero)) ? inside : zero;
      i -= pass.level;
      // The nearest sample.
      constexpr float kScale = PatternField::kSamplesPerPx;
      Lanes column = u * kScale + pass.origin_u, line = v * kScale + pass.origin_v;
      column = column > zero ? column : zero;
      line = line > zero ? line : zero;
      column = column < last_column ? column : zero + last_column;
      line = line < last_row ? line : zero + last_row;
      const IntLanes at_column = __builtin_convertvector(column + 0.5F, IntLanes),
                     at_line = __builtin_convertvector(line + 0.5F, IntLanes);
      const IntLanes at = at_line * pass.field_width + at_column;
      BitLanes bits;
      for (int lane = 0; lane < kLanes; ++lane) bits[lane] = pass.samples[at[lane]];
      constexpr int kBits = PatternField::kSlopeBits;
      const Lanes value = __builtin_convertvector(reinterpret_cast<IntLanes>(bits >> (2 * kBits)), Lanes);
      const Lanes slope_u =
          __builtin_convertvector(reinterpret_cast<IntLanes>(bits << (32 - 2 * kBits)) >> (32 - kBits), Lanes) *
          pass.slope_unit;
      const Lanes slope_v =
          __builtin_convertvector(reinterpret_cast<IntLanes>(bits << (32 - kBits)) >> (32 - kBits), Lanes) *
          pass.slope_unit;
      const Lanes from_u = column - __builtin_convertvector(at_column, Lanes),
                  from_v = line - __builtin_convertvector(at_line, Lanes);
      const Lanes p = value * PatternField::kValueUnit + (slope_u * from_u + slope_v * from_v) * (1 / kScale);
      const Lanes g = slope_u * warp.along_u + slope_v * warp.along_v;
      const Lanes c = slope_v * warp.along_u - slope_u * warp.along_v;
      const Lanes residual = i - p * (pass.gain + pass.gain_y * y + pass.gain_x * x) - pass.offset;
      const Lanes off = residual * pass.per_scale;
      const Lanes weight = one / (one + off * off);
      const Lanes w = counted * weight * weight;
      const Lanes wg = w * g, wp = w * p, wc = w * c, wi = w * i;
      const Lanes gg = wg * g, gp = wg * p, pp = wp * p, gc = wg * c, pc = wp * c, ig = wg * i, ip = wp * i;
      const Lanes ggx = gg * x, gpx = gp * x, ppx = pp * x;
      sum[kGG] += gg, sum[kGG + 1] += ggx, sum[kGG + 2] += ggx * x;
      sum[kGP] += gp, sum[kGP + 1] += gpx, sum[kGP + 2] += gpx * x;
      sum[kPP] += pp, sum[kPP + 1] += ppx, sum[kPP + 2] += ppx * x;
      sum[kG] += wg, sum[kG + 1] += wg * x;
      sum[kP] += wp, sum[kP + 1] += wp * x;
      sum[kGC] += gc, sum[kGC + 1] += gc * x;
      sum[kPC] += pc, sum[kPC + 1] += pc * x;
      sum[kIG] += ig, sum[kIG + 1] += ig * x;
      sum[kIP] += ip, sum[kIP + 1] += ip * x;
      const Lanes gr = wg * residual;
      const IntLanes in_left = x<pass.third_left, in_right = x> pass.third_right;
      sum[kGR] += gr, sum[kGRLeft] += in_left ? gr : zero, sum[kGRRight] += in_right ? gr : zero;
      sum[kGGLeft] += in_left ? gg : zero, sum[kGGRight] += in_right ? gg : zero;
      sum[kW] += w, sum[kC] += wc, sum[kCC] += wc * c, sum[kIC] += wc * i, sum[kI] += wi, sum[kII] += wi * i,
          sum[kPixels] += counted;
    }
    Lanes* const part = parts[y < pass.third_top ? 0 : y > pass.third_bottom ? 2 : 1];
    part[0] += sum[kGRLeft], part[1] += sum[kGR] - sum[kGRLeft] - sum[kGRRight], part[2] += sum[kGRRight];
    part[3] += sum[kGGLeft], part[4] += sum[kGG] - sum[kGGLeft] - sum[kGGRight], part[5] += sum[kGGRight];
    const float yy = y * y;
    gg_y += y * sum[kGG], gg_xy += y * sum[kGG + 1], gg_yy += yy * sum[kGG];
    gp_y += y * sum[kGP], gp_xy += y * sum[kGP + 1], gp_yy += yy * sum[kGP];
    pp_y += y * sum[kPP], pp_xy += y * sum[kPP + 1], pp_yy += yy * sum[kPP];
    g_y += y * sum[kG], p_y += y * sum[kP], gc_y += y * sum[kGC], pc_y += y * sum[kPC], ig_y += y * sum[kIG],
        ip_y += y * sum[kIP];
    for (int k = 0; k < kRowSums; ++k) total[k] += sum[k];
  }
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      sums.part_gr[3 * row + column] = sum_of(parts[row][column]);
      sums.part_gg[3 * row + column] = sum_of(parts[row][3 + column]);
    }
  }
  const auto six = [&](float* to, RowSum from, const Lanes& by_y, const Lanes& by_xy, const Lanes& by_yy) {
    to[0] = sum_of(total[from]), to[1] = sum_of(total[from + 1]), to[2] = sum_of(by_y);
    to[3] = sum_of(total[from + 2]), to[4] = sum_of(by_xy), to[5] = sum_of(by_yy);
  };
  const auto three = [&](float* to, RowSum from, const Lanes& by_y) {
    to[0] = sum_of(total[from]), to[1] = sum_of(total[from + 1]), to[2] = sum_of(by_y);
  };
  six(sums.gg, kGG, gg_y, gg_xy, gg_yy), six(sums.gp, kGP, gp_y, gp_xy, gp_yy), six(sums.pp, kPP, pp_y, pp_xy, pp_yy);
  three(sums.g, kG, g_y), three(sums.p, kP, p_y), three(sums.gc, kGC, gc_y), three(sums.pc, kPC, pc_y);
  three(sums.ig, kIG, ig_y), three(sums.ip, kIP, ip_y);
  sums.w = sum_of(total[kW]), sums.c = sum_of(total[kC]), sums.cc = sum_of(total[kCC]), sums.ic = sum_of(total[kIC]);
  sums.i = sum_of(total[kI]), sums.ii = sum_of(total[kII]), sums.pixels = sum_of(total[kPixels]);
}

/// Root mean square distance of the ninths from the plane, by their disparities, beyond noise.
float scatter_of(const Sums& sums, float gain, float noise) {
  float squares = 0, expected = 0, weight = 0;
  for (int part = 0; part < 9; ++part) {
    const float gg = sums.part_gg[part];
    if (!(gg > 0)) continue;
    squares += sums.part_gr[part] * sums.part_gr[part] / gg;  // gg (disparity of the part)^2
    expected += noise * noise;
    weight += gg;
  }
  return weight > 0 ? std::sqrt(std::max(0.F, squares - expected) / weight) / gain : 0;
}

Warp warp_of(const PatchMap& map, const PatchState& state) {
  Warp warp;
  for (int k = 0; k < 3; ++k) {
    const float shift = map.shift[k];
    warp.constant[k] = map.base(k, 2) + shift * state.disparity;
    warp.x[k] = map.base(k, 0) + shift * state.slope_x;
    warp.y[k] = map.base(k, 1) + shift * state.slope_y;
    warp.xx[k] = shift * state.bend_xx, warp.xy[k] = shift * state.bend_xy, warp.yy[k] = shift * state.bend_yy;
  }
  warp.along_u = map.along.x(), warp.along_v = map.along.y();
  const Eigen::Vector2f across = state.across * across_of(map);
  warp.across_u = across.x(), warp.across_v = across.y();
  return warp;
}

using Normal = Eigen::Matrix<double, kFitted, kFitted>;
using Unknowns = Eigen::Matrix<double, kFitted, 1>;

/// The columns are g (1, x, y), c, p (1, x, y), 1.
void fill(const Sums& s, Normal& normal, Unknowns& right) {
  const auto block = [&](int row, int column, const float* six) {
    constexpr int kIndex[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) normal(row + i, column + k) = normal(column + k, row + i) = six[kIndex[i][k]];
  };
  block(0, 0, s.gg), block(0, 4, s.gp), block(4, 4, s.pp);
  for (int i = 0; i < 3; ++i) {
    normal(i, 3) = normal(3, i) = s.gc[i];
    normal(i, 7) = normal(7, i) = s.g[i];
    normal(4 + i, 3) = normal(3, 4 + i) = s.pc[i];
    normal(4 + i, 7) = normal(7, 4 + i) = s.p[i];
    right[i] = s.ig[i], right[4 + i] = s.ip[i];
  }
  normal(3, 3) = s.cc, normal(3, 7) = normal(7, 3) = s.c, normal(7, 7) = s.w;
  right[3] = s.ic, right[7] = s.i;
}

}  // namespace

PatchMap make_patch_map(const PixelRay& ray, const Eigen::Vector2d& middle_px,
                        const RigidTransform& projector_from_camera, const Lens& projector, double reference_depth_mm) {
  return make_patch_map(turned_by(ray, projector_from_camera), middle_px, projector_from_camera.translation, projector,
                        1 / reference_depth_mm);
}

Eigen::Matrix3d turned_by(const PixelRay& ray, const RigidTransform& projector_from_camera) {
  Eigen::Matrix3d turned;
  turned.leftCols<2>() = projector_from_camera.rotation.leftCols<2>() * ray.turn;
  turned.col(2) = projector_from_camera.rotation * ray.direction.homogeneous();
  return turned;
}

PatchMap make_patch_map(const Eigen::Matrix3d& turned, const Eigen::Vector2d& middle_px,
                        const Eigen::Vector3d& translation, const Lens& projector, double reference_inverse_depth) {
  PatchMap map;
  map.reference_inverse_depth = reference_inverse_depth;
  const Eigen::Vector3d middle = turned.col(2) + reference_inverse_depth * translation;
  const double scale = 1 / middle.z();
  const Eigen::Vector2d direction = scale * middle.head<2>();
  const Eigen::Vector2d pixel = projector.distort(direction);
  map.origin_px = {static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y()))};
  // The lens linearised around the direction, from the origin; scaled so that q2 is 1 at the centre.
  const Eigen::Matrix2d bend = projector.distort_jacobian(direction);
  const Eigen::Vector2d from_origin = pixel - map.origin_px.cast<double>();
  const auto through_lens = [&](const Eigen::Vector3d& q) {
    const Eigen::Vector2d flat = q.head<2>() - q.z() * direction;
    return Eigen::Vector3d(scale * (bend(0, 0) * flat.x() + bend(0, 1) * flat.y() + from_origin.x() * q.z()),
                           scale * (bend(1, 0) * flat.x() + bend(1, 1) * flat.y() + from_origin.y() * q.z()),
                           scale * q.z());
  };
  const Eigen::Vector3d t = through_lens(translation);
  const Eigen::Vector2d per_inverse_depth = t.head<2>() - from_origin * t.z();
  map.inverse_depth_per_px = 1 / per_inverse_depth.norm();
  map.along = (per_inverse_depth * map.inverse_depth_per_px).cast<float>();
  map.base.col(0) = through_lens(turned.col(0)).cast<float>();
  map.base.col(1) = through_lens(turned.col(1)).cast<float>();
  map.base.col(2) = Eigen::Vector3d(from_origin.x(), from_origin.y(), 1).cast<float>();
  map.shift = (t * map.inverse_depth_per_px).cast<float>();
  map.middle_px = middle_px.cast<float>();
  return map;
}

template <class T>
PatchFit PatchAligner::align(const ImageView<T>& frame, double full, float noise, const PatternField& field,
                             const PatchMap& map, const PatchWindow& window, const PatchState& start) {
  PatchFit fit;
  fit.state = start;
  const int stride = (window.width + kLanes - 1) / kLanes * kLanes;
  patch_.assign(static_cast<std::size_t>(stride) * window.height, kNotCounted);
  const int first = std::max(0, -window.left), end = std::min(window.width, frame.width - window.left);
  float sum = 0;
  int count = 0;
  for (int y = std::max(0, -window.top); y < window.height && window.top + y < frame.height; ++y) {
    const T* row = frame.row(window.top + y) + window.left;
    float* to = patch_.data() + static_cast<std::ptrdiff_t>(y) * stride;
    for (int x = first; x < end; ++x) {
      if (row[x] >= full) continue;
      to[x] = static_cast<float>(row[x]);
      sum += to[x], ++count;
    }
  }
  if (count == 0) return fit;

  Pass pass{};
  pass.patch = patch_.data(), pass.stride = stride, pass.height = window.height;
  pass.first_x = static_cast<float>(window.left) - map.middle_px.x();
  pass.first_y = static_cast<float>(window.top) - map.middle_px.y();
  pass.middle_u = window.square_middle_px.x() - static_cast<float>(map.origin_px.x());
  pass.middle_v = window.square_middle_px.y() - static_cast<float>(map.origin_px.y());
  pass.half = window.square_half_px;
  // The square's own thirds: the window is one pixel larger on each side.
  const float third_x = (static_cast<float>(window.width) - 3) / 6,
              third_y = (static_cast<float>(window.height) - 3) / 6;
  const float mid_x = pass.first_x + 0.5F * static_cast<float>(window.width - 1),
              mid_y = pass.first_y + 0.5F * static_cast<float>(window.height - 1);
  pass.third_left = mid_x - third_x, pass.third_right = mid_x + third_x;
  pass.third_top = mid_y - third_y, pass.third_bottom = mid_y + third_y;
  pass.samples = field.samples(), pass.field_width = field.width(), pass.field_height = field.height();
  pass.origin_u = static_cast<float>((map.origin_px.x() + PatternField::kBorderPx) * PatternField::kSamplesPerPx);
  pass.origin_v = static_cast<float>((map.origin_px.y() + PatternField::kBorderPx) * PatternField::kSamplesPerPx);
  pass.slope_unit = field.slope_unit();
  pass.level = sum / static_cast<float>(count);

  const auto weigh_by = [&](const PatchState& state) {
    pass.gain = state.gain, pass.gain_x = state.gain_x, pass.gain_y = state.gain_y;
    pass.offset = state.offset - pass.level;
    pass.per_scale = 1 / (options_.outlier_sigmas * std::hypot(noise, options_.misfit_share * state.gain));
  };
  if (start.gain > 0) weigh_by(start);
  Normal normal;
  Unknowns right;
  for (int step = 0; step < options_.steps; ++step) {
    pass.warp = warp_of(map, fit.state);
    Sums sums;
    Cloned<sum_patch>::call(pass, sums);
    fit.pixels = sums.pixels;
    fit.support = sums.w / std::max(1.F, sums.pixels);
    if (!(sums.w > 2 * kFitted)) return fit;
    fill(sums, normal, right);
    // The prior of `across`, in units of the other equations: its column is c times the gain.
    const double gain = std::max(1.F, std::abs(fit.state.gain));
    const double weight = options_.across_sigma_px > 0 ? std::pow(noise / (gain * options_.across_sigma_px), 2) : 1e12;
    normal(3, 3) += weight;
    right[3] -= weight * gain * fit.state.across;
    if (options_.gain_slope_sigma > 0) {
      const double misfit = std::hypot(static_cast<double>(noise), options_.misfit_share * gain);
      const double of_slopes = std::pow(misfit / (gain * options_.gain_slope_sigma), 2);
      normal(5, 5) += of_slopes, normal(6, 6) += of_slopes;
    }
    const Eigen::LDLT<Normal> solver(normal);
    if (solver.info() != Eigen::Success || !solver.isPositive()) return fit;
    const Unknowns solution = solver.solve(right);
    const double new_gain = solution[4];
    if (!solution.allFinite() || !(new_gain > noise)) return fit;
    PatchState& state = fit.state;
    state.gain = static_cast<float>(new_gain);
    state.gain_x = static_cast<float>(solution[5]), state.gain_y = static_cast<float>(solution[6]);
    state.offset = static_cast<float>(solution[7]) + pass.level;
    const auto moved = [&](int k) { return std::clamp(static_cast<float>(solution[k] / new_gain), -1.F, 1.F); };
    state.disparity += moved(0), state.slope_x += moved(1), state.slope_y += moved(2), state.across += moved(3);
    const double squares = sums.ii - solution.dot(right);
    fit.residual = static_cast<float>(std::sqrt(std::max(0.0, squares) / sums.w));
    weigh_by(state);
    fit.scatter = scatter_of(sums, static_cast<float>(new_gain), fit.residual);
    if (step + 1 == options_.steps) {
      const Eigen::Matrix<double, kFitted, 4> unit = Eigen::Matrix<double, kFitted, 4>::Identity();
      fit.covariance = (solver.solve(unit).topRows<4>() / (new_gain * new_gain)).template cast<float>();
    }
  }
  fit.solved = true;
  return fit;
}

template PatchFit PatchAligner::align(const ImageView<std::uint8_t>&, double, float, const PatternField&,
                                      const PatchMap&, const PatchWindow&, const PatchState&);
template PatchFit PatchAligner::align(const ImageView<std::uint16_t>&, double, float, const PatternField&,
                                      const PatchMap&, const PatchWindow&, const PatchState&);

Eigen::Vector2f projector_offset(const PatchMap& map, const PatchState& state, const Eigen::Vector2f& offset) {
  const float bend = 0.5F * (state.bend_xx * offset.x() * offset.x() + state.bend_yy * offset.y() * offset.y()) +
                     state.bend_xy * offset.x() * offset.y();
  const Eigen::Vector3f q =
      map.base * offset.homogeneous() +
      map.shift * (state.disparity + state.slope_x * offset.x() + state.slope_y * offset.y() + bend);
  return q.hnormalized() + state.across * across_of(map);
}

Eigen::Vector2f camera_offset(const PatchMap& map, const PatchState& state, const Eigen::Vector2f& pixel) {
  // The bend moves the pixel by some hundredths: three fixed-point iterations are enough.
  const Eigen::Vector2f target = pixel - state.across * across_of(map);
  Eigen::Vector2f offset = Eigen::Vector2f::Zero();
  for (int round = 0; round < 3; ++round) {
    Eigen::Matrix3f q = map.base + map.shift * Eigen::RowVector3f(state.slope_x, state.slope_y, state.disparity);
    q.col(2) +=
        map.shift * (0.5F * (state.bend_xx * offset.x() * offset.x() + state.bend_yy * offset.y() * offset.y()) +
                     state.bend_xy * offset.x() * offset.y());
    Eigen::Matrix2f a;
    a << q.topLeftCorner<2, 2>() - target * q.bottomLeftCorner<1, 2>();
    offset = a.inverse() * (target * q(2, 2) - q.topRightCorner<2, 1>());
  }
  return offset;
}

}  // namespace slsd
