// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/places/track.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Geometry>

namespace slsd::model {
namespace {

/// A frame becomes a keyframe if it is turned by this much from the last one, or overlaps with it by less.
constexpr double kKeyframeDegrees = 10;
constexpr double kKeyframeOverlap = 0.75;
/// A frame is placed by so many of the latest keyframes.
constexpr std::size_t kLatest = 3;
constexpr std::size_t kFewestCells = 100;

// Limits of a frame that fits, found on rendered busts: docs/model.md.
constexpr double kFewestOverlap = 0.3;
constexpr double kFewestAgreeing = 0.7;
constexpr double kGreatestFit = 2.5;
constexpr double kFewestDetermined = 0.002;

}  // namespace

double turn_degrees(const RigidTransform& a, const RigidTransform& b) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(a.rotation.transpose() * b.rotation)).angle() * 180 / std::numbers::pi;
}

std::string refusal_of(const Alignment& alignment) {
  if (alignment.determined < kFewestDetermined)
    return "the surface has too little relief: nothing determines " + to_string(alignment.least_determined);
  if (alignment.overlap < kFewestOverlap)
    return fmt::format("only {:.0f} % of what it shows lies on the surface so far", 100 * alignment.overlap);
  if (alignment.agreeing < kFewestAgreeing || alignment.fit > kGreatestFit)
    return fmt::format("it does not fit: its usual distance is {:.1f} sigma, and {:.0f} % agree within three",
                       alignment.fit, 100 * alignment.agreeing);
  return {};
}

RigidTransform Tracker::expected() const {
  const RigidTransform& last = frames_.back().object_from_rig;
  if (frames_.size() < 2) return last;
  const ModelFrame& before = frames_[frames_.size() - 2];
  if (lost_ || frames_.back().number - before.number > 1) return last;
  RigidTransform next = last.after(before.object_from_rig.inverse().after(last));
  // Each product doubles what a rotation lacks in being one.
  next.rotation = Eigen::Quaterniond(next.rotation).normalized().toRotationMatrix();
  return next;
}

std::vector<PlacedShot> Tracker::latest_keyframes() const {
  std::vector<PlacedShot> latest;
  for (std::size_t i = keyframes_.size() - std::min(kLatest, keyframes_.size()); i < keyframes_.size(); ++i) {
    const ModelFrame& frame = frames_[keyframes_[i]];
    latest.push_back({&frame.shot, frame.object_from_rig});
  }
  return latest;
}

std::optional<Alignment> Tracker::search(const Shot& shot) const {
  std::optional<Alignment> best;
  for (const std::size_t keyframe : keyframes_) {
    const ModelFrame& known = frames_[keyframe];
    const PlacedShot reference{&known.shot, known.object_from_rig};
    // Where the shots' middles meet.
    RigidTransform start = known.object_from_rig;
    start.translation += start.rotation * (known.shot.middle_mm() - shot.middle_mm());
    const auto found = align(shot, {&reference, 1}, start);
    if (found && refusal_of(*found).empty() && (!best || found->pairs > best->pairs)) best = found;
  }
  return best;
}

/// Tries the known step about each axis of the rig through the middle of the object, either way.
std::optional<Alignment> Tracker::step(const Shot& shot) const {
  std::optional<Alignment> best;
  const ModelFrame& last = frames_.back();
  const PlacedShot reference{&last.shot, last.object_from_rig};
  const Eigen::Vector3d middle = last.shot.middle_mm();
  for (const int axis : {1, 0, 2}) {
    for (const double degrees : {step_degrees_, -step_degrees_}) {
      RigidTransform turn;
      turn.rotation =
          Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d::Unit(axis)).toRotationMatrix();
      turn.translation = middle - turn.rotation * middle;
      const auto found = align(shot, {&reference, 1}, last.object_from_rig.after(turn));
      if (found && refusal_of(*found).empty() && (!best || found->pairs > best->pairs)) best = found;
    }
  }
  return best;
}

Tracked Tracker::begin(const Shot& shot) const {
  const PlacedShot self{&shot, {}};
  auto alignment = align(shot, {&self, 1}, {});
  if (!alignment) return {{}, "the surface is too small", false};
  if (auto refusal = refusal_of(*alignment); !refusal.empty()) return {{}, std::move(refusal), false};
  alignment->object_from_rig = {};
  return {alignment, {}, false};
}

Tracked Tracker::follow(const Shot& shot) const {
  const std::vector<PlacedShot> references = latest_keyframes();
  std::string refusal = "it meets nothing of the surface so far";
  for (const RigidTransform& start : {expected(), frames_.back().object_from_rig}) {
    const auto found = align(shot, references, start);
    if (!found) continue;
    refusal = refusal_of(*found);
    if (refusal.empty()) return {found, {}, lost_};
  }
  if (step_degrees_ > 0) {
    if (const auto found = step(shot)) return {found, {}, lost_};
  }
  if (const auto found = search(shot)) return {found, {}, true};
  return {{}, std::move(refusal), false};
}

Tracked Tracker::add(std::size_t number, Shot shot) {
  if (shot.cells() < kFewestCells) {
    lost_ = !frames_.empty();
    return {{}, "it shows almost nothing: the object left the view, or the scan failed", false};
  }
  Tracked tracked = frames_.empty() ? begin(shot) : follow(shot);
  lost_ = !tracked.alignment && !frames_.empty();
  if (!tracked.alignment) return tracked;
  const Alignment& alignment = *tracked.alignment;
  for (SurfaceView& view : shot.views) view.image.drop_pixels();
  frames_.push_back({number, std::move(shot), alignment.object_from_rig});
  const bool is_new =
      keyframes_.empty() || alignment.overlap < kKeyframeOverlap ||
      turn_degrees(frames_[keyframes_.back()].object_from_rig, alignment.object_from_rig) > kKeyframeDegrees;
  if (is_new) keyframes_.push_back(frames_.size() - 1);
  return tracked;
}

}  // namespace slsd::model
