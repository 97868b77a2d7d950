// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tf/transform_tree.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace slsd::dds {
namespace {

constexpr double kNoUnitMax = 0.01;  // as tf2
constexpr std::uint32_t kSecondNs = 1'000'000'000;

double seconds_between(RosTime from, RosTime to) {
  return std::chrono::duration<double>(to - from).count();
}

// Names of tf1 began with a slash.
std::string frame_name(const std::string& told) {
  return told.starts_with('/') ? told.substr(1) : told;
}

Result<> check_numbers(const ros::TransformStamped& told, const std::string& parent, const std::string& child) {
  const auto malformed = [&](const std::string& how) {
    return fail(ErrorCode::kMalformed,
                fmt::format("tf_malformed: the transform from \"{}\" to \"{}\" {}", parent, child, how));
  };
  if (parent.empty() || child.empty()) return malformed("lacks a frame's name");
  if (parent == child) return malformed("places a frame in itself");
  const auto& [x, y, z] = told.translation;
  const auto& turn = told.rotation;
  for (const double number : {x, y, z, turn.x, turn.y, turn.z, turn.w})
    if (!std::isfinite(number)) return malformed("has a number that is not finite");
  const double norm = Eigen::Vector4d(turn.x, turn.y, turn.z, turn.w).norm();
  if (std::abs(norm - 1) > kNoUnitMax)
    return malformed(fmt::format("has a quaternion of length {:.3g} instead of 1", norm));
  if (told.header.stamp.nanosec >= kSecondNs) return malformed("has a stamp with more than a second of nanoseconds");
  return {};
}

Result<> check_stamp(RosTime at, const std::string& child, RosTime now) {
  if (at == RosTime()) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("tf_stamp: the transform of \"{}\" has the time zero: its publisher sets no time", child));
  }
  if (at > now + TransformTree::kAheadMax) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("tf_future: the transform of \"{}\" is stamped {:.3g} s in the future: synchronise the "
                            "clocks of both hosts (chrony, PTP)",
                            child, seconds_between(now, at)));
  }
  if (at < now - TransformTree::kHistory) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("tf_old: the transform of \"{}\" is {:.3g} s old: synchronise the clocks of both hosts "
                            "(chrony, PTP), and do not use simulated time",
                            child, seconds_between(at, now)));
  }
  return {};
}

}  // namespace

RosTime time_of(const ros::Time& stamp) {
  return RosTime(std::chrono::seconds(stamp.sec) + std::chrono::nanoseconds(stamp.nanosec));
}

Result<> TransformTree::add(const ros::TransformStamped& told, bool fixed, std::uint64_t publisher, RosTime now) {
  const std::string parent = frame_name(told.header.frame_id), child = frame_name(told.child_frame_id);
  if (auto numbers = check_numbers(told, parent, child); !numbers) return numbers;
  const RosTime at = time_of(told.header.stamp);
  if (!fixed) {
    if (auto stamp = check_stamp(at, child, now); !stamp) return stamp;
  }
  const auto& turn = told.rotation;
  const Sample sample{at,
                      {Eigen::Quaterniond(turn.w, turn.x, turn.y, turn.z).normalized(),
                       {told.translation.x, told.translation.y, told.translation.z}}};
  auto known = links_.find(child);
  if (known != links_.end()) {
    Link& link = known->second;
    const bool same = link.parent == parent && link.fixed == fixed;
    const Sample& last = link.samples.back();
    // A robot's description that is published again says the same.
    const bool repeated = same && fixed && last.pose.place_m == sample.pose.place_m &&
                          last.pose.turn.coeffs() == sample.pose.turn.coeffs();
    if (repeated) return {};
    if (!link.fixed && last.at < now - kHistory) {  // its publisher has ended
      samples_ -= link.samples.size();
      links_.erase(known);
      known = links_.end();
    } else if (link.publisher != publisher || (!same && !(fixed && link.fixed))) {
      link.rival = fmt::format("{} in \"{}\"", fixed ? "fixed" : "moving", parent);
      link.rival_until = fixed ? RosTime::max() : std::max(link.rival_until, now + kHistory);
      return fail(ErrorCode::kMismatch, fmt::format("tf_two_parents: \"{}\" is placed twice, {} in \"{}\" and {}",
                                                    child, link.fixed ? "fixed" : "moving", link.parent, link.rival));
    } else if (fixed) {
      link.parent = parent;
      link.samples.back() = sample;
      return {};
    }
  }
  if (samples_ >= kSamplesMax || (known == links_.end() && links_.size() >= kFramesMax))
    return fail(ErrorCode::kNoSpace, "tf_full: tf has more frames and transforms than a robot's");
  if (known == links_.end()) known = links_.try_emplace(child, Link{parent, fixed, publisher, {}, {}, {}}).first;
  return add_sample(known->second, child, sample);
}

Result<> TransformTree::add_sample(Link& link, const std::string& child, const Sample& sample) {
  auto& samples = link.samples;
  if (!samples.empty() && sample.at <= samples.back().at) {
    const Pose &last = samples.back().pose, &now = sample.pose;
    const bool same = last.place_m == now.place_m && last.turn.coeffs() == now.turn.coeffs();
    if (same && sample.at == samples.back().at) return {};
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("tf_stamp: a transform of \"{}\" is not newer than the one before", child));
  }
  samples.push_back(sample);
  ++samples_;
  while (samples.front().at < sample.at - kHistory) {
    samples.pop_front();
    --samples_;
  }
  return {};
}

Result<TransformTree::Path> TransformTree::path_to_root(const std::string& frame) const {
  Path path;
  for (auto at = links_.find(frame); at != links_.end(); at = links_.find(at->second.parent)) {
    const bool again = std::ranges::find(path, &*at) != path.end();
    path.push_back(&*at);
    if (!again) continue;
    std::string loop;
    for (const auto* each : path) loop += "\"" + each->first + "\" in ";
    loop.resize(loop.size() - 4);
    return fail(ErrorCode::kMismatch, "tf_loop: tf has a loop: " + loop);
  }
  return path;
}

Result<TransformTree::Paths> TransformTree::paths(const std::string& base, const std::string& flange,
                                                  RosTime now) const {
  for (const std::string& frame : {base, flange}) {
    const auto names = [&](const auto& link) { return link.first == frame || link.second.parent == frame; };
    if (std::ranges::none_of(links_, names))
      return fail(ErrorCode::kNotFound, fmt::format("tf_missing: tf has no frame \"{}\"", frame));
  }
  auto to_base = path_to_root(base), to_flange = path_to_root(flange);
  if (!to_base) return tl::unexpected(to_base.error());
  if (!to_flange) return tl::unexpected(to_flange.error());
  const std::string base_root = to_base->empty() ? base : to_base->back()->second.parent;
  const std::string flange_root = to_flange->empty() ? flange : to_flange->back()->second.parent;
  if (base_root != flange_root) {
    return fail(ErrorCode::kNotFound, fmt::format("tf_unconnected: \"{}\" descends from \"{}\", but \"{}\" from \"{}\"",
                                                  flange, flange_root, base, base_root));
  }
  while (!to_base->empty() && !to_flange->empty() && to_base->back() == to_flange->back()) {
    to_base->pop_back();
    to_flange->pop_back();
  }
  for (const Path* path : {&*to_base, &*to_flange}) {
    for (const auto* each : *path) {
      const Link& link = each->second;
      if (!link.rival.empty() && link.rival_until > now) {
        return fail(
            ErrorCode::kMismatch,
            fmt::format("tf_two_parents: \"{}\" is placed twice, {} in \"{}\" and {}: end one of the publishers{}",
                        each->first, link.fixed ? "fixed" : "moving", link.parent, link.rival,
                        link.rival_until == RosTime::max() ? ", then start slsd-dds again" : ""));
      }
    }
  }
  return Paths{std::move(*to_base), std::move(*to_flange)};
}

Result<TransformTree::Pose> TransformTree::pose_at(const std::string& child, const Link& link, RosTime at) {
  const auto& samples = link.samples;
  if (link.fixed) return samples.back().pose;
  if (at > samples.back().at) {
    return fail(ErrorCode::kTimeout,
                fmt::format("tf_late: the newest transform of \"{}\" is {:.3f} s older than needed", child,
                            seconds_between(samples.back().at, at)));
  }
  if (at < samples.front().at) {
    return fail(ErrorCode::kImpossible, fmt::format("tf_history: the oldest kept transform of \"{}\" is {:.3f} s newer "
                                                    "than needed",
                                                    child, seconds_between(at, samples.front().at)));
  }
  const auto after = std::ranges::lower_bound(samples, at, {}, &Sample::at);
  if (after->at == at) return after->pose;
  const Sample &from = *(after - 1), &to = *after;
  if (to.at - from.at > kGapMax) {
    return fail(ErrorCode::kMismatch,
                fmt::format("tf_gap: \"{}\" has transforms that are {:.3f} s apart; publish them at least every {} ms",
                            child, seconds_between(from.at, to.at), kGapMax.count()));
  }
  const double share = seconds_between(from.at, at) / seconds_between(from.at, to.at);
  return Pose{from.pose.turn.slerp(share, to.pose.turn),
              from.pose.place_m + share * (to.pose.place_m - from.pose.place_m)};
}

Result<RigidTransform> TransformTree::base_from_flange(const std::string& base, const std::string& flange, RosTime at,
                                                       RosTime now) const {
  constexpr double kMetreMm = 1000;
  const auto both = paths(base, flange, now);
  if (!both) return tl::unexpected(both.error());
  RigidTransform ancestor_from[2];
  for (const auto& [path, ancestor_from_frame] :
       {std::pair(&both->base, &ancestor_from[0]), std::pair(&both->flange, &ancestor_from[1])}) {
    for (const auto* each : *path) {
      const auto pose = pose_at(each->first, each->second, at);
      if (!pose) return tl::unexpected(pose.error());
      const RigidTransform parent_from_child{pose->turn.toRotationMatrix(), kMetreMm * pose->place_m};
      *ancestor_from_frame = parent_from_child.after(*ancestor_from_frame);
    }
  }
  return ancestor_from[0].inverse().after(ancestor_from[1]);
}

Result<RosTime> TransformTree::newest(const std::string& base, const std::string& flange, RosTime now) const {
  const auto both = paths(base, flange, now);
  if (!both) return tl::unexpected(both.error());
  RosTime newest = now;
  for (const Path* path : {&both->base, &both->flange}) {
    for (const auto* each : *path)
      if (!each->second.fixed) newest = std::min(newest, each->second.samples.back().at);
  }
  return newest;
}

}  // namespace slsd::dds
