// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/solve/start/corner_pose.hpp"

#include <algorithm>
#include <vector>

#include <opencv2/calib3d.hpp>

namespace slsd {
namespace {

constexpr std::size_t kCornersMin = 4;

RigidTransform refined(const PoseView& view, PoseSubject subject, const RigModel& rig,
                       const RigidTransform& camera_from_board) {
  const LensVector& lens = rig.cameras[view.camera].lens;
  const cv::Matx33d matrix(lens[0], 0, lens[2], 0, lens[1], lens[3], 0, 0, 1);
  const cv::Vec<double, 5> distortion(lens[4], lens[5], lens[6], lens[7], lens[8]);
  std::vector<cv::Point3d> board;
  std::vector<cv::Point2d> image;
  for (const BoardPoint& corner : view.corners) {
    const Eigen::Vector3d printed = rig.printed_mm(corner.board_mm, subject);
    board.emplace_back(printed.x(), printed.y(), printed.z());
    image.emplace_back(corner.camera_px.x(), corner.camera_px.y());
  }
  const MotionVector begin = to_vector(camera_from_board);
  cv::Vec3d turn(begin[0], begin[1], begin[2]), shift(begin[3], begin[4], begin[5]);
  try {
    cv::solvePnP(board, image, matrix, distortion, turn, shift, true, cv::SOLVEPNP_ITERATIVE);
  } catch (const cv::Exception&) {
    return camera_from_board;
  }
  return to_motion({turn[0], turn[1], turn[2], shift[0], shift[1], shift[2]});
}

}  // namespace

std::optional<MotionVector> pose_by_corners(const PoseObservation& pose, const RigModel& rig,
                                            const MotionVector& begin) {
  const auto most = std::ranges::max_element(pose.views, {}, [](const PoseView& view) { return view.corners.size(); });
  if (most == pose.views.end() || most->corners.size() < kCornersMin) return std::nullopt;
  const RigidTransform camera_from_rig = to_motion(rig.cameras[most->camera].device_from_rig);
  const RigidTransform camera_from_board = camera_from_rig.after(to_motion(begin));
  return to_vector(camera_from_rig.inverse().after(refined(*most, pose.subject, rig, camera_from_board)));
}

}  // namespace slsd
