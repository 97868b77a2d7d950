// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tf/robot_poses.hpp"

#include <algorithm>
#include <array>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "core/geometry/robot_pose.hpp"

namespace slsd::dds {
namespace {

using namespace std::chrono_literals;

constexpr auto kStanding = 500ms, kStandingStep = 25ms;
constexpr auto kStandingWait = 10s;  // discovery takes some of it
constexpr double kStandingMm = 0.3, kStandingDegrees = 0.03;

RosTime ros_now() {
  return std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now());
}

// FNV-1a
std::uint64_t id_of(const std::array<std::uint8_t, 16>& guid) {
  std::uint64_t id = 0xcbf29ce484222325;
  for (const std::uint8_t byte : guid) id = (id ^ byte) * 0x100000001b3;
  return id;
}

// Tells whether later transforms may help.
bool may_come(const Error& error) {
  return error.code == ErrorCode::kNotFound || error.code == ErrorCode::kTimeout;
}

}  // namespace

Result<std::unique_ptr<RobotPoses>> RobotPoses::open(const Network& network, const RobotFrames& frames) {
  if (frames.base.empty() || frames.flange.empty() || frames.base == frames.flange)
    return fail(ErrorCode::kInvalidArgument, "--robot-base and --flange must name two frames of tf");
  const auto moving = network.reader(ros::TFMessage::kType, "rt/tf", Quality::kTransforms);
  const auto fixed = network.reader(ros::TFMessage::kType, "rt/tf_static", Quality::kLatched);
  if (!moving || !fixed) return tl::unexpected((moving ? fixed : moving).error());
  return std::unique_ptr<RobotPoses>(new RobotPoses(network, frames, *moving, *fixed));
}

RobotPoses::RobotPoses(const Network& network, RobotFrames frames, Reader moving, Reader fixed)
    : network_(network), frames_(std::move(frames)), moving_(moving), fixed_(fixed) {
  reader_ = std::jthread([this](const std::stop_token& stop) {
    while (!stop.stop_requested()) read();
  });
}

void RobotPoses::read() {
  network_.wait_for({moving_, fixed_}, 100ms);
  const std::lock_guard lock(mutex_);
  take(fixed_, true);
  take(moving_, false);
  changed_.notify_all();
}

void RobotPoses::take(const Reader& reader, bool fixed) {
  const auto refuse = [this](const std::string& why) {
    refused_ = why;
    refused_at_ = ros_now();
  };
  while (const auto sample = reader.take()) {
    const auto message = decode<ros::TFMessage>(sample->bytes);
    if (!message) refuse("tf_malformed: a message is not a tf2_msgs/TFMessage");
    if (!message) continue;
    for (const auto& transform : message->transforms) {
      const auto added = tree_.add(transform, fixed, id_of(sample->from.guid), ros_now());
      if (!added) refuse(added.error().message);
    }
  }
}

Result<RigidTransform> RobotPoses::look_up(RosTime time) const {
  auto pose = tree_.base_from_flange(frames_.base, frames_.flange, time, ros_now());
  if (!pose) return pose;
  const auto reached = check_reach(*pose);
  if (reached) return pose;
  return fail(
      reached.error().code,
      fmt::format("tf_unreachable: the pose of \"{}\" in \"{}\" {}: tf has metres, and these must be the frames of "
                  "flange and base",
                  frames_.flange, frames_.base, reached.error().message));
}

Result<RigidTransform> RobotPoses::at(RosTime time) const {
  std::unique_lock lock(mutex_);
  const auto end = std::chrono::steady_clock::now() + kWait;
  auto pose = look_up(time);
  while (!pose && may_come(pose.error()) && changed_.wait_until(lock, end) != std::cv_status::timeout)
    pose = look_up(time);
  return with_refused(std::move(pose));
}

Result<RigidTransform> RobotPoses::look_up_standing() const {
  const RosTime now = ros_now();
  const auto newest = tree_.newest(frames_.base, frames_.flange, now);
  if (!newest) return tl::unexpected(newest.error());
  if (*newest < now - TransformTree::kGapMax) {
    return fail(ErrorCode::kTimeout, fmt::format("tf_late: the newest pose of \"{}\" is {:.3f} s old", frames_.flange,
                                                 std::chrono::duration<double>(now - *newest).count()));
  }
  auto pose = look_up(*newest);
  for (auto before = kStandingStep; pose && before <= kStanding; before += kStandingStep) {
    auto earlier = look_up(*newest - before);
    if (!earlier) return earlier;
    const double moved_mm = (pose->translation - earlier->translation).norm();
    const double turned = Eigen::AngleAxisd(pose->rotation.transpose() * earlier->rotation).angle();
    if (moved_mm <= kStandingMm && turned * 180 / std::numbers::pi <= kStandingDegrees) continue;
    return fail(
        ErrorCode::kBusy,
        fmt::format("flange_moves: \"{}\" moved by {:.2f} mm and {:.3f} degrees within {} ms: keep the robot still",
                    frames_.flange, moved_mm, turned * 180 / std::numbers::pi, before.count()));
  }
  return pose;
}

Result<RigidTransform> RobotPoses::standing() const {
  std::unique_lock lock(mutex_);
  const auto end = std::chrono::steady_clock::now() + kStandingWait;
  auto pose = look_up_standing();
  const auto grows = [](const Error& error) { return error.code == ErrorCode::kImpossible; };  // the history
  while (!pose && (may_come(pose.error()) || grows(pose.error())) &&
         changed_.wait_until(lock, end) != std::cv_status::timeout)
    pose = look_up_standing();
  return with_refused(std::move(pose));
}

Result<RigidTransform> RobotPoses::with_refused(Result<RigidTransform> pose) const {
  if (pose || refused_.empty() || ros_now() - refused_at_ > TransformTree::kHistory) return pose;
  const std::string& why = pose.error().message;
  if (why.starts_with(refused_.substr(0, refused_.find(':')))) return pose;  // it says so already
  return fail(pose.error().code, why + "; " + refused_);
}

}  // namespace slsd::dds
