// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/solve/start/initial_rig.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>

#include "core/calibrate/solve/bundle.hpp"
#include "core/calibrate/solve/point_residuals.hpp"
#include "core/calibrate/solve/start/resection.hpp"
#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

constexpr std::size_t kPosesMin = 3;
/// Limits of a camera's focal length in widths of the image. Values beyond them mean that the poses do not determine
/// it.
constexpr double kFocalMin = 0.2, kFocalMax = 50;
/// Ratio between trial focal lengths: close enough for Zhang's method to converge.
constexpr double kFocalStep = 1.12;
/// A focal length is judged by the best-fitting share of the views, so that wrong views have no influence. If those
/// errors exceed the best focal length's by this factor, it fits wrong views.
constexpr double kJudgingShare = 0.6, kNearlyBest = 2;
/// A view this many times farther off than most, and by so many px, is excluded from the first estimate. If it is still
/// so many px off with its camera's distortion known, it shows no board. A bent or a moved board is off by less, and is
/// recognised later.
constexpr double kGrossFactor = 8, kDoubtfulPx = 4, kNoBoardPx = 20;
/// Smallest angle between the two boards whose tilts differ most.
constexpr double kTiltsApartMinDeg = 8;
constexpr char kTilt[] = "tilt the board by 20 to 40 degrees to the camera in most poses, each time to another side";

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

using Views = std::vector<const PoseView*>;

Views views_of(std::size_t camera, const Observations& observations) {
  Views views;
  for (const PoseObservation& pose : observations.poses) {
    for (const PoseView& view : pose.views) {
      if (view.camera == camera) views.push_back(&view);
    }
  }
  return views;
}

LensVector plain_lens(double focal, const ImageSize& size) {
  return {focal, focal, 0.5 * (size.width_px - 1), 0.5 * (size.height_px - 1), 0, 0, 0, 0, 0};
}

/// Zhang's estimate; 0 if the views do not determine it.
double zhang_focal(const Views& views, const ImageSize& size) {
  CornerLists lists;
  for (const PoseView* view : views) append(*view, lists);
  double focal = 0;
  try {
    focal = cv::initCameraMatrix2D(lists.board, lists.image, {size.width_px, size.height_px}, 1).at<double>(0, 0);
  } catch (const cv::Exception&) {
    return 0;
  }
  return focal > kFocalMin * size.width_px && focal < kFocalMax * size.width_px ? focal : 0;
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

/// Error of the corners in their best-fitting pose, under a lens without distortion.
double error_px(const PoseView& view, const LensVector& lens, const ImageSize& size) {
  const auto camera_from_board = pose_of(view, lens);
  if (!camera_from_board) return std::numeric_limits<double>::infinity();
  const Lens camera = to_lens(lens, size);
  std::vector<Eigen::Vector2d> errors;
  for (const BoardPoint& corner : view.corners) {
    const Eigen::Vector3d on_board(corner.board_mm.x(), corner.board_mm.y(), 0);
    errors.push_back(camera.project(*camera_from_board * on_board) - corner.camera_px);
  }
  return rms_px(errors);
}

std::vector<double> errors_px(const Views& views, const LensVector& lens, const ImageSize& size) {
  std::vector<double> errors;
  for (const PoseView* view : views) errors.push_back(error_px(*view, lens, size));
  return errors;
}

/// Root mean square of the smallest share of the errors.
double judged_px(std::vector<double> errors, double share = kJudgingShare) {
  std::ranges::sort(errors);
  const auto count = static_cast<std::size_t>(std::ceil(share * static_cast<double>(errors.size())));
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) sum += errors[i] * errors[i];
  return std::sqrt(sum / static_cast<double>(count));
}

double limit_px(const std::vector<double>& errors, double least_px) {
  return std::max(kGrossFactor * median_of(errors), least_px);
}

/// Zhang's estimate from all views, or, if it fits most of them badly, from those that agree; 0 if they do not
/// determine it.
double estimate_focal(const Views& views, const ImageSize& size) {
  const double of_all = zhang_focal(views, size);
  std::vector<double> least;
  for (double focal = kFocalMin * size.width_px; focal < kFocalMax * size.width_px; focal *= kFocalStep) {
    std::vector<double> errors = errors_px(views, plain_lens(focal, size), size);
    if (least.empty() || judged_px(errors) < judged_px(least)) least = std::move(errors);
  }
  if (of_all > 0 && judged_px(errors_px(views, plain_lens(of_all, size), size)) <= kNearlyBest * judged_px(least)) {
    return of_all;
  }
  Views agreeing;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (least[i] <= limit_px(least, kDoubtfulPx)) agreeing.push_back(views[i]);
  }
  const double of_agreeing = agreeing.size() < kPosesMin ? 0 : zhang_focal(agreeing, size);
  return of_agreeing > 0 ? of_agreeing : of_all;
}

Result<LensVector> estimate_lens(const Observations& observations, std::size_t camera) {
  const auto& [name, size] = observations.cameras[camera];
  const Views views = views_of(camera, observations);
  if (views.size() < kPosesMin) {
    return fail(ErrorCode::kImpossible,
                "only " + std::to_string(views.size()) + " of the poses can be used, but at least " +
                    std::to_string(kPosesMin) + " are needed; 10 to 15 make a good calibration",
                "camera " + name);
  }
  const double focal = estimate_focal(views, size);
  if (focal == 0) {
    return fail(ErrorCode::kImpossible,
                std::string("all poses are parallel, which leaves the focal length undetermined; ") + kTilt,
                "camera " + name);
  }
  return plain_lens(focal, size);
}

/// Camera from board, for every view.
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

/// Places each camera by a pose that it shares with a placed camera.
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
                  "no pose shows the board to this camera and another one at once; show it to both",
                  "camera " + observations.cameras[camera].name);
    }
    rig.cameras[camera].device_from_rig = to_vector(placed[camera]);
  }
  return {};
}

/// Ascending: poses with a view that is far off under the first estimate of its camera; empty if too few others are
/// left.
std::vector<std::size_t> find_doubtful(const Observations& observations, const RigModel& rig) {
  std::vector<bool> doubtful(observations.poses.size());
  for (std::size_t camera = 0; camera < rig.cameras.size(); ++camera) {
    const auto& [size, lens, _] = rig.cameras[camera];
    const std::vector<double> errors = errors_px(views_of(camera, observations), lens, size);
    auto error = errors.begin();
    for (std::size_t i = 0; i < doubtful.size(); ++i) {
      for (const PoseView& view : observations.poses[i].views) {
        if (view.camera != camera) continue;
        doubtful[i] = doubtful[i] || (std::isfinite(*error) && *error > limit_px(errors, kDoubtfulPx));
        ++error;
      }
    }
  }
  std::vector<std::size_t> indices;
  std::vector<std::size_t> left(rig.cameras.size());
  for (std::size_t i = 0; i < doubtful.size(); ++i) {
    if (doubtful[i]) indices.push_back(i);
    for (const PoseView& view : observations.poses[i].views) left[view.camera] += doubtful[i] ? 0 : 1;
  }
  return std::ranges::min(left) < kPosesMin ? std::vector<std::size_t>() : indices;
}

/// Adjusts the cameras to the other poses, and judges the doubtful ones by them.
/// @param initial  poses that are already known to be faulty are excluded
Result<> judge_doubtful(const std::vector<std::size_t>& doubtful, const Observations& observations,
                        InitialRig& initial) {
  std::vector<std::size_t> aside = doubtful;
  for (const FaultyPose& faulty : initial.faulty) aside.push_back(faulty.pose);
  std::ranges::sort(aside);
  Observations others = observations;
  RigModel rig = initial.rig;
  for (auto i = aside.rbegin(); i != aside.rend(); ++i) {
    others.poses.erase(others.poses.begin() + static_cast<std::ptrdiff_t>(*i));
    rig.rig_from_board.erase(rig.rig_from_board.begin() + static_cast<std::ptrdiff_t>(*i));
  }
  BundleOptions cameras_alone;
  for (const DeviceModel& camera : rig.cameras) {
    cameras_alone.cameras.push_back(plausible_distortion(camera.size, camera.lens[0]));
  }
  cameras_alone.with_symbols = false;
  if (auto solved = adjust(others, cameras_alone, rig); !solved) return tl::unexpected(solved.error());
  const auto error_of = [&](const PoseObservation& pose, const MotionVector& place) {
    std::vector<Eigen::Vector2d> all;
    for (const PoseView& view : pose.views) {
      const auto residuals = residuals_of(view, rig, place).corners_px;
      all.insert(all.end(), residuals.begin(), residuals.end());
    }
    return rms_px(all);
  };
  std::vector<double> usual;
  for (std::size_t i = 0; i < others.poses.size(); ++i)
    usual.push_back(error_of(others.poses[i], rig.rig_from_board[i]));
  for (const std::size_t i : aside) {
    const MotionVector place = estimate_pose(observations.poses[i], rig).value_or(initial.rig.rig_from_board[i]);
    const double error = error_of(observations.poses[i], place);
    rig.rig_from_board.insert(rig.rig_from_board.begin() + static_cast<std::ptrdiff_t>(i), place);
    if (error <= limit_px(usual, kNoBoardPx) || !std::ranges::binary_search(doubtful, i)) continue;
    initial.faulty.push_back({i, PoseFault::kUnlike,
                              fmt::format("it contradicts the other poses: its corners are off by {:.0f} px, theirs by "
                                          "{:.2f} px, so one camera cannot have taken both. Take it again",
                                          error, median_of(usual))});
  }
  initial.rig = std::move(rig);
  return {};
}

/// A pose's symbols, at the points where the cameras' rays to them meet its board.
std::vector<SpacePoint> space_points(const PoseObservation& pose, const RigModel& rig, const MotionVector& place) {
  std::vector<SpacePoint> points;
  const RigidTransform rig_from_board = to_motion(place);
  for (const PoseView& view : pose.views) {
    for (const ProjectedPoint& symbol : view.symbols) {
      const auto met = rig.meet(rig.cameras[view.camera], rig_from_board, symbol.camera_px, pose.subject);
      if (met) points.push_back({*met, symbol.projector_px});
    }
  }
  return points;
}

/// Median error of each pose's symbols, in the projector.
std::vector<double> errors_px(const std::vector<std::vector<SpacePoint>>& poses, const Resection& projector) {
  std::vector<double> errors;
  for (const auto& points : poses) {
    std::vector<double> off;
    for (const SpacePoint& point : points) {
      const Eigen::Vector3d seen = projector.device_from_points * point.point_mm;
      const auto& lens = projector.lens;
      const Eigen::Vector2d pixel(lens[0] * seen.x() / seen.z() + lens[2], lens[1] * seen.y() / seen.z() + lens[3]);
      off.push_back((pixel - point.pixel).norm());
    }
    errors.push_back(median_of(std::move(off)));
  }
  return errors;
}

/// Number of symbols that suffices to judge a pose.
constexpr std::size_t kSymbolsOfPose = 60;
constexpr std::size_t kStartsTried = 24;
constexpr double kHalf = 0.5;  // share of the poses that stay right if a device moved in the middle

/// Ascending: poses that are far off, if at least half of them are not.
std::vector<std::size_t> far_off(const std::vector<double>& errors) {
  std::vector<double> sorted = errors;
  std::ranges::sort(sorted);
  const double limit = std::max(kGrossFactor * sorted[(sorted.size() - 1) / 2], kNoBoardPx);
  std::vector<std::size_t> far;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (!(errors[i] <= limit)) far.push_back(i);
  }
  return far;
}

/// Resects from all poses or, if that leaves some far off, from the run of poses that fits most of them best. A wholly
/// wrong pose, or a device that moved during the session, leaves some run intact.
Result<Resection> resect_most(const std::vector<std::vector<SpacePoint>>& poses) {
  const auto resect_but = [](const std::vector<std::vector<SpacePoint>>& some, const std::vector<std::size_t>& wrong) {
    std::vector<SpacePoint> points;
    for (std::size_t i = 0; i < some.size(); ++i) {
      if (!std::ranges::binary_search(wrong, i)) points.insert(points.end(), some[i].begin(), some[i].end());
    }
    return resect(points);
  };
  auto of_all = resect_but(poses, {});
  if (of_all && std::ranges::max(errors_px(poses, *of_all)) <= kNoBoardPx) return of_all;
  auto few = poses;
  for (auto& points : few) {
    const std::size_t step = std::max<std::size_t>(1, points.size() / kSymbolsOfPose);
    std::size_t i = 0;
    std::erase_if(points, [&](const SpacePoint&) { return i++ % step != 0; });
  }
  const std::size_t count = poses.size();
  double least =
      of_all ? judged_px(errors_px(few, *of_all), kHalf) / kNearlyBest : std::numeric_limits<double>::infinity();
  std::vector<double> best;
  for (const std::size_t length : {std::max(kPosesMin, count / 3), std::max(kPosesMin, count / 2)}) {
    for (std::size_t start = 0; start < count && length < count; start += count / kStartsTried + 1) {
      std::vector<SpacePoint> points;  // wraps from the last pose to the first
      for (std::size_t i = start; i < start + length; ++i) {
        points.insert(points.end(), few[i % count].begin(), few[i % count].end());
      }
      const auto of_run = resect(points);
      if (!of_run) continue;
      std::vector<double> errors = errors_px(few, *of_run);
      if (const double error = judged_px(errors, kHalf); error < least) least = error, best = std::move(errors);
    }
  }
  return best.empty() ? of_all : resect_but(poses, far_off(best));
}

}  // namespace

FaultyPose fits_no_plane(std::size_t pose) {
  return {pose, PoseFault::kUnlike, "its corners do not fit a plane; take it again"};
}

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
  const std::vector<std::size_t> doubtful = find_doubtful(observations, rig);
  ViewPoses trusted = poses;
  for (const std::size_t i : doubtful) trusted[i].clear();
  if (auto placed = place_cameras(observations, trusted, rig); !placed) return tl::unexpected(placed.error());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (poses[i].empty()) {
      initial.faulty.push_back(fits_no_plane(i));
      rig.rig_from_board.emplace_back();
      continue;
    }
    const auto& [camera, camera_from_board] = *poses[i].begin();
    rig.rig_from_board.push_back(
        to_vector(to_motion(rig.cameras[camera].device_from_rig).inverse().after(camera_from_board)));
  }
  if (!doubtful.empty()) {
    if (auto judged = judge_doubtful(doubtful, observations, initial); !judged) return tl::unexpected(judged.error());
    std::ranges::sort(initial.faulty, {}, &FaultyPose::pose);
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
  return fail(
      ErrorCode::kImpossible,
      fmt::format("all poses are parallel within {:.1f} degrees, which leaves the focal lengths undetermined; {}",
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

Result<std::vector<std::size_t>> estimate_projector(const Observations& observations, RigModel& rig) {
  std::vector<std::vector<SpacePoint>> points;
  for (std::size_t i = 0; i < observations.poses.size(); ++i) {
    points.push_back(space_points(observations.poses[i], rig, rig.rig_from_board[i]));
  }
  const auto solved = resect_most(points);
  if (!solved) return tl::unexpected(solved.error());
  const double focal_max = kFocalMax * rig.projector.size.width_px, focal_min = kFocalMin * rig.projector.size.width_px;
  if (!(solved->lens[0] > focal_min && solved->lens[0] < focal_max && solved->lens[1] > focal_min &&
        solved->lens[1] < focal_max)) {
    return fail(ErrorCode::kImpossible,
                std::string("the poses do not determine the projector's focal length, which came out as ") +
                    std::to_string(static_cast<long>(solved->lens[0])) + " px; vary the distance, and " + kTilt);
  }
  rig.projector.lens = solved->lens;
  rig.projector.device_from_rig = to_vector(solved->device_from_points);
  std::vector<std::size_t> doubtful = far_off(errors_px(points, *solved));
  return points.size() - doubtful.size() < kPosesMin ? std::vector<std::size_t>() : doubtful;
}

}  // namespace slsd
