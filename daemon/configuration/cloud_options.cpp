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
constexpr double kUnitTolerance = 0.01;  // for normals with three decimals

bool near(const std::vector<double>& numbers) {
  return std::ranges::all_of(numbers,
                             [](double number) { return std::isfinite(number) && std::abs(number) <= kFarMm; });
}

}  // namespace

Result<> CloudOptions::validate() const {
  const auto refuse = [](const char* key, const char* why) { return fail(ErrorCode::kInvalidArgument, why, key); };
  if (!box.empty() && (box.size() != 6 || !near(box)))
    return refuse("box", "must have six numbers: x, y and z of the least corner, then of the other, in mm");
  for (std::size_t axis = 0; axis + 3 < box.size(); ++axis)
    if (!(box[axis] < box[axis + 3]))
      return refuse("box", "must have its least corner first: x, y and z of the second must be greater");
  if (!plane.empty() && (plane.size() != 4 || !near(plane)))
    return refuse("plane", "must have four numbers: x, y and z of its normal, and its offset along it in mm");
  if (!plane.empty() && std::abs(Eigen::Vector3d(plane[0], plane[1], plane[2]).norm() - 1) > kUnitTolerance)
    return refuse("plane", "must begin with a normal of length 1");
  if (!(voxel_mm >= 0 && voxel_mm <= kVoxelMostMm)) return refuse("voxel_mm", "must be from 0 to 1000");
  if (stride < 1 || stride > kStrideMost) return refuse("stride", "must be from 1 to 64");
  return {};
}

CloudPart CloudOptions::part(const RigidTransform& frame_from_rig) const {
  CloudPart part{.voxel_mm = voxel_mm, .stride = stride};
  if (box.size() == 6) part.box = MeasuredBox{{box[0], box[1], box[2]}, {box[3], box[4], box[5]}, frame_from_rig};
  if (plane.size() == 4) {
    const Eigen::Vector3d normal(plane[0], plane[1], plane[2]);
    part.side = HalfSpace{normal.normalized(), plane[3] / normal.norm()}.in(frame_from_rig);
  }
  return part;
}

}  // namespace slsd
