// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cmath>

#include "core/appearance/patch_map.hpp"
#include "core/appearance/patch_sums.hpp"
#include "core/appearance/pattern_field.hpp"
#include "core/geometry/lens.hpp"
#include "core/lanes.hpp"

namespace slsd {

using DoubleLanes [[gnu::vector_size(64)]] = double;

/// Camera and projector, in plain numbers.
struct MapGeometry {
  double translation[3];  ///< of projector_from_camera
  Lens projector;
  EpipolarOffset offset;
};

/// Planes through eight camera pixels, one in each lane.
struct EightPlanes {
  Lanes x, y;              ///< camera px
  const float* turned;     ///< turned_by() of the first pixel, column by column; the others follow
  Lanes inverse_depth;     ///< 1/mm
  Lanes slope_x, slope_y;  ///< its change for one camera px
  Lanes across;            ///< offset of the pattern from its line, projector px, beyond EpipolarOffset
};

/// Sets the maps of eight planes, as make_patch_map() does for one. Sets also the slopes in projector px.
/// @param px_per  projector px for 1/mm
inline __attribute__((always_inline)) void put_maps(const MapGeometry& of, const EightPlanes& planes, Eight& to,
                                                    Lanes& px_per) {
  const DoubleLanes one = DoubleLanes{} + 1;
  DoubleLanes turned[3][3];  // [column][row]
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row)
      for (int lane = 0; lane < kLanes; ++lane)
        turned[column][row][lane] = static_cast<double>(planes.turned[9 * lane + 3 * column + row]);
  const DoubleLanes rho = __builtin_convertvector(planes.inverse_depth, DoubleLanes);
  DoubleLanes middle[3];
  for (int row = 0; row < 3; ++row) middle[row] = turned[2][row] + rho * of.translation[row];
  const DoubleLanes scale = one / middle[2], x = scale * middle[0], y = scale * middle[1];
  Lens::View<DoubleLanes> seen;
  of.projector.view(x, y, seen);
  const DoubleLanes &u = seen.u, &v = seen.v;
  // Neither is negative by more than that.
  constexpr int kFar = 1 << 20;
  to.origin_u = __builtin_convertvector(u + (kFar + 0.5), IntLanes) - kFar;
  to.origin_v = __builtin_convertvector(v + (kFar + 0.5), IntLanes) - kFar;
  const DoubleLanes from_u = u - __builtin_convertvector(to.origin_u, DoubleLanes),
                    from_v = v - __builtin_convertvector(to.origin_v, DoubleLanes);
  const auto through_lens = [&](const DoubleLanes* q, DoubleLanes* image) __attribute__((always_inline)) {
    const DoubleLanes flat_x = q[0] - q[2] * x, flat_y = q[1] - q[2] * y;
    image[0] = scale * (seen.u_x * flat_x + seen.u_y * flat_y + from_u * q[2]);
    image[1] = scale * (seen.v_x * flat_x + seen.v_y * flat_y + from_v * q[2]);
    image[2] = scale * q[2];
  };
  const DoubleLanes translation[3] = {one * of.translation[0], one * of.translation[1], one * of.translation[2]};
  DoubleLanes t[3], base[2][3];
  through_lens(translation, t), through_lens(turned[0], base[0]), through_lens(turned[1], base[1]);
  const DoubleLanes along_u = t[0] - from_u * t[2], along_v = t[1] - from_v * t[2];
  DoubleLanes norm = along_u * along_u + along_v * along_v;
  for (int lane = 0; lane < kLanes; ++lane) norm[lane] = std::sqrt(norm[lane]);
  const DoubleLanes per_px = one / norm;
  to.along_u = __builtin_convertvector(along_u * per_px, Lanes);
  to.along_v = __builtin_convertvector(along_v * per_px, Lanes);
  px_per = __builtin_convertvector(norm, Lanes);
  Lanes shift[3];
  for (int k = 0; k < 3; ++k) shift[k] = __builtin_convertvector(t[k] * per_px, Lanes);
  for (int k = 0; k < 3; ++k) {
    to.x[k] = __builtin_convertvector(base[0][k], Lanes) + shift[k] * planes.slope_x * px_per;
    to.y[k] = __builtin_convertvector(base[1][k], Lanes) + shift[k] * planes.slope_y * px_per;
  }
  to.constant[0] = __builtin_convertvector(from_u, Lanes), to.constant[1] = __builtin_convertvector(from_v, Lanes);
  to.constant[2] = Lanes{} + 1;
  const Lanes off = of.offset.middle + of.offset.slope_x * (planes.x - of.offset.middle_px.x()) +
                    of.offset.slope_y * (planes.y - of.offset.middle_px.y());
  to.across = planes.across;
  to.across_u = -(off + planes.across) * to.along_v, to.across_v = (off + planes.across) * to.along_u;
  constexpr int kBorder = PatternField::kBorderPx, kScale = PatternField::kSamplesPerPx;
  to.origin_u = (to.origin_u + kBorder) * kScale, to.origin_v = (to.origin_v + kBorder) * kScale;
}

}  // namespace slsd
