// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/initial_rig.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>

#include "core/calibrate/board_plane.hpp"
#include "core/calibrate/resection.hpp"

namespace slsd {
namespace {

constexpr std::size_t kPosesMin = 3;
/// A focal length beyond these, in widths of the image, is not of a camera but of poses that do not tell it.
constexpr double kFocalMin = 0.2, kFocalMax = 50;
/// Between the two boards that face ways the farthest apart.
constexpr double kTiltsApartMinDeg = 8;
constexpr char kTilt[] =
    "hold the board at an angle of 20 to 40 degrees to the camera in most poses, each time towards another side";

struct CornerLists {
  std::vector<std::vector<cv::Point3f>> board;
  std::vector<std::vector<cv::Point2f>> image;
};

void append(const PoseView& view, CornerLists& lists) {
  auto& board = lists.board.emplace_back();
  auto& image = lists.image.emplace_back();
  for (const BoardPoint& corner : view.corners) {
    board.emplace_back(static_cast<float>(corner.board_mm.x()), static_cast<float>(corner.board_mm.y()), 0.F);
    image.emplace_back(static_cast<float>(corner.camera_px.x()), static_cast<float>(corner.camera_px.y()));
  }
}

Result<LensVector> estimate_lens(const Observations& observations, std::size_t camera) {
  CornerLists lists;
  for (const PoseObservation& pose : observations.poses) {
    for (const PoseView& view : pose.views) {
      if (view.camera == camera) append(view, lists);
    }
  }
  const auto& [name, size] = observations.cameras[camera];
  if (lists.board.size() < kPosesMin) {
    return fail(ErrorCode::kImpossible,
                "only " + std::to_string(lists.board.size()) + " of the poses can be used, and " +
                    std::to_string(kPosesMin) + " are the least; 10 to 15 make a good calibration",
                "camera " + name);
  }
  double focal = 0;
  try {
    focal = cv::initCameraMatrix2D(lists.board, lists.image, {size.width_px, size.height_px}, 1).at<double>(0, 0);
  } catch (const cv::Exception&) {
    focal = 0;
  }
  if (!(focal > kFocalMin * size.width_px && focal < kFocalMax * size.width_px)) {
    return fail(ErrorCode::kImpossible,
                std::string("the poses are all parallel, which leaves the focal length open; ") + kTilt,
                "camera " + name);
  }
  return LensVector{focal, focal, 0.5 * (size.width_px - 1), 0.5 * (size.height_px - 1), 0, 0, 0, 0, 0};
}

std::optional<RigidTransform> pose_of(const PoseView& view, const LensVector& lens) {
  CornerLists lists;
  append(view, lists);
  const cv::Matx33d matrix(lens[0], 0, lens[2], 0, lens[1], lens[3], 0, 0, 1);
  const std::vector<double> distortion(lens.begin() + 4, lens.end());
  cv::Vec3d turn, shift;
  try {
    if (!cv::solvePnP(lists.board[0], lists.image[0], matrix, distortion, turn, shift, false, cv::SOLVEPNP_IPPE))
      return std::nullopt;
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  return to_motion({turn[0], turn[1], turn[2], shift[0], shift[1], shift[2]});
}

/// Camera from board, of every view.
using ViewPoses = std::vector<std::map<std::size_t, RigidTransform>>;

ViewPoses poses_of_views(const Observations& observations, const RigModel& rig) {
  ViewPoses poses(observations.poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    for (const PoseView& view : observations.poses[i].views) {
      if (const auto pose = pose_of(view, rig.cameras[view.camera].lens)) poses[i][view.camera] = *pose;
    }
  }
  return poses;
}

/// Places each camera by a pose that it shares with one which is placed already.
Result<> place_cameras(const Observations& observations, const ViewPoses& poses, RigModel& rig) {
  std::map<std::size_t, RigidTransform> placed{{0, RigidTransform{}}};  // camera from rig
  for (bool grew = true; grew && placed.size() < rig.cameras.size();) {
    grew = false;
    for (const auto& views : poses) {
      const auto known = std::ranges::find_if(views, [&](const auto& view) { return placed.contains(view.first); });
      if (known == views.end()) continue;
      for (const auto& [camera, camera_from_board] : views) {
        if (placed.contains(camera)) continue;
        placed[camera] = camera_from_board.after(known->second.inverse()).after(placed[known->first]);
        grew = true;
      }
    }
  }
  for (std::size_t camera = 0; camera < rig.cameras.size(); ++camera) {
    if (!placed.contains(camera)) {
      return fail(ErrorCode::kImpossible,
                  "no pose shows the board to this camera and another one at the same time; show it to both",
                  "camera " + observations.cameras[camera].name);
    }
    rig.cameras[camera].device_from_rig = to_vector(placed[camera]);
  }
  return {};
}

}  // namespace

Result<InitialRig> estimate_cameras(const Observations& observations) {
  InitialRig initial;
  RigModel& rig = initial.rig;
  rig.projector.size = observations.projector;
  for (std::size_t camera = 0; camera < observations.cameras.size(); ++camera) {
    const auto lens = estimate_lens(observations, camera);
    if (!lens) return tl::unexpected(lens.error());
    rig.cameras.push_back({observations.cameras[camera].size, *lens, {}});
  }
  const ViewPoses poses = poses_of_views(observations, rig);
  if (auto placed = place_cameras(observations, poses, rig); !placed) return tl::unexpected(placed.error());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (poses[i].empty()) {
      initial.unplaced.push_back(i);
      rig.rig_from_board.emplace_back();
      continue;
    }
    const auto& [camera, camera_from_board] = *poses[i].begin();
    rig.rig_from_board.push_back(
        to_vector(to_motion(rig.cameras[camera].device_from_rig).inverse().after(camera_from_board)));
  }
  return initial;
}

Result<> check_tilts(const RigModel& rig) {
  double least_cosine = 1;
  for (const MotionVector& a : rig.rig_from_board) {
    for (const MotionVector& b : rig.rig_from_board) {
      least_cosine = std::min(least_cosine, to_motion(a).rotation.col(2).dot(to_motion(b).rotation.col(2)));
    }
  }
  const double apart_deg = std::acos(std::max(least_cosine, -1.0)) * 180 / std::numbers::pi;
  if (apart_deg >= kTiltsApartMinDeg) return {};
  return fail(ErrorCode::kImpossible,
              fmt::format("the poses are all parallel, within {:.1f} degrees, which leaves the focal lengths open; {}",
                          apart_deg, kTilt));
}

std::optional<MotionVector> estimate_pose(const PoseObservation& pose, const RigModel& rig) {
  for (const PoseView& view : pose.views) {
    const DeviceModel& camera = rig.cameras[view.camera];
    const auto camera_from_board = pose_of(view, camera.lens);
    if (camera_from_board) return to_vector(to_motion(camera.device_from_rig).inverse().after(*camera_from_board));
  }
  return std::nullopt;
}

Result<> estimate_projector(const Observations& observations, RigModel& rig) {
  std::vector<SpacePoint> points;
  for (std::size_t i = 0; i < observations.poses.size(); ++i) {
    const RigidTransform rig_from_board = to_motion(rig.rig_from_board[i]);
    for (const PoseView& view : observations.poses[i].views) {
      for (const ProjectedPoint& symbol : view.symbols) {
        points.push_back({meet_board(rig.cameras[view.camera], rig_from_board, symbol.camera_px), symbol.projector_px});
      }
    }
  }
  const auto solved = resect(points);
  if (!solved) return tl::unexpected(solved.error());
  const double focal_max = kFocalMax * rig.projector.size.width_px, focal_min = kFocalMin * rig.projector.size.width_px;
  if (!(solved->lens[0] > focal_min && solved->lens[0] < focal_max && solved->lens[1] > focal_min &&
        solved->lens[1] < focal_max)) {
    return fail(ErrorCode::kImpossible,
                std::string("the poses do not tell the projector's focal length: it came out as ") +
                    std::to_string(static_cast<long>(solved->lens[0])) + " px; vary the distance too, and " + kTilt);
  }
  rig.projector.lens = solved->lens;
  rig.projector.device_from_rig = to_vector(solved->device_from_points);
  return {};
}

}  // namespace slsd
