// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/cloud_options.hpp"

#include <algorithm>
#include <cmath>

namespace slsd {
namespace {

constexpr double kVoxelMostMm = 1000;
constexpr int kStrideMost = 64;
constexpr double kFarMm = 1e6;

}  // namespace

Result<> CloudOptions::validate() const {
  const auto refuse = [](const char* key, const char* why) { return fail(ErrorCode::kInvalidArgument, why, key); };
  const bool finite =
      std::ranges::all_of(box, [](double number) { return std::isfinite(number) && std::abs(number) <= kFarMm; });
  if (!box.empty() && (box.size() != 6 || !finite))
    return refuse("box", "must have six numbers: x, y and z of the least corner, then of the other, in mm");
  for (std::size_t axis = 0; axis + 3 < box.size(); ++axis)
    if (!(box[axis] < box[axis + 3]))
      return refuse("box", "must have its least corner first: x, y and z of the second must be greater");
  if (!(voxel_mm >= 0 && voxel_mm <= kVoxelMostMm)) return refuse("voxel_mm", "must be from 0 to 1000");
  if (stride < 1 || stride > kStrideMost) return refuse("stride", "must be from 1 to 64");
  return {};
}

CloudPart CloudOptions::part() const {
  CloudPart part{.voxel_mm = voxel_mm, .stride = stride};
  if (box.size() == 6) part.box = MeasuredBox{{box[0], box[1], box[2]}, {box[3], box[4], box[5]}};
  return part;
}

}  // namespace slsd
