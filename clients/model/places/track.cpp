// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/places/track.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <utility>

#include <tbb/parallel_for.h>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "clients/model/places/two_bodies.hpp"

namespace slsd::model {
namespace {

/// A frame becomes a keyframe if it is turned by this much from the last one, or overlaps with it by less.
constexpr double kKeyframeDegrees = 10;
constexpr double kKeyframeOverlap = 0.75;
/// A frame is placed by so many of the latest keyframes.
constexpr std::size_t kLatest = 3;
constexpr std::size_t kFewestCells = 100;
/// Greatest shares of the cells of one shot that another misses in its place. In right places, rendered objects had at
/// most 0.009 of cells that light passed, and 0.12 that were silent: dense clouds have holes. In wrong places of a
/// bust, at least 0.024 were passed in one of both shots.
constexpr double kMostThrough = 0.012, kMostSilent = 0.15;
/// A lost object is expected within so many degrees of where its last turns lead, or of where it was lost if that was
/// at most so many frames ago: later, its other side may have come round.
constexpr double kExpectedDegrees = 45;
constexpr std::size_t kRecently = 8;
/// Its turns are those of so many frames.
constexpr std::size_t kSteady = 5;
/// A shot whose thickness has this ratio to its width is flat.
constexpr double kFlatRatio = 0.05;
/// Rounds in which the marks of foreign cells grow.
constexpr int kRounds = 3;

constexpr const char* kTwoBodies =
    "two bodies in view move differently: show only one of them, or leave out the static one with --background or "
    "--box";

/// Tells whether a witness sees what the other shot saw.
bool sees(const PlacedShot& witness, const PlacedShot& shot) {
  const MissingShares missing = missing_shares(shot, witness);
  return missing.through < kMostThrough && missing.silent < kMostSilent;
}

/// Tells whether a shot is like a plane, whose other side may look the same.
bool is_flat(const Shot& shot) {
  const Eigen::Vector3d middle = shot.middle_mm();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  for (const SurfaceView& view : shot.views)
    for (const SurfaceCell& cell : view.levels.back().cells) {
      const Eigen::Vector3d off = cell.place_mm.cast<double>() - middle;
      if (cell.sigma_mm > 0) squares += off * off.transpose();
    }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(squares, Eigen::EigenvaluesOnly);
  return axes.eigenvalues()[0] < kFlatRatio * kFlatRatio * axes.eigenvalues()[2];
}

}  // namespace

double turn_degrees(const RigidTransform& a, const RigidTransform& b) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(a.rotation.transpose() * b.rotation)).angle() * 180 / std::numbers::pi;
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
  for (std::size_t i = keyframes_.size() - std::min(kLatest, keyframes_.size()); i < keyframes_.size(); ++i)
    latest.push_back(frames_[keyframes_[i]].placed());
  return latest;
}

bool Tracker::is_expected(std::size_t number, const RigidTransform& object_from_rig) const {
  const ModelFrame& last = frames_.back();
  const std::size_t since = number - last.number;
  if (since <= kRecently && turn_degrees(last.object_from_rig, object_from_rig) < kExpectedDegrees) return true;
  if (frames_.size() < 2) return false;
  const ModelFrame& before = frames_[frames_.size() - std::min(kSteady, frames_.size())];
  Eigen::AngleAxisd turn(Eigen::Matrix3d(last.object_from_rig.rotation * before.object_from_rig.rotation.transpose()));
  turn.angle() *= static_cast<double>(since) / static_cast<double>(last.number - before.number);
  return turn_degrees({turn * last.object_from_rig.rotation, {}}, object_from_rig) < kExpectedDegrees;
}

bool Tracker::is_found(const PlacedShot& placed, std::size_t number, std::span<const PlacedShot> references) const {
  if (std::ranges::none_of(references, [&](const PlacedShot& reference) { return sees(placed, reference); }))
    return false;
  if (is_expected(number, placed.object_from_rig)) return true;
  // A hand in this shot is not known as one yet, so that only an unexpected place needs all of the shot confirmed.
  return !is_flat(*placed.shot) &&
         std::ranges::any_of(references, [&](const PlacedShot& reference) { return sees(reference, placed); });
}

std::optional<Alignment> Tracker::search(std::size_t number, const Shot& shot) const {
  std::optional<Alignment> best;
  for (const std::size_t keyframe : keyframes_) {
    const ModelFrame& known = frames_[keyframe];
    const PlacedShot reference = known.placed();
    // Where the shots' middles meet.
    RigidTransform start = known.object_from_rig;
    start.translation += start.rotation * (known.shot.middle_mm() - shot.middle_mm());
    const auto found = align(shot, {&reference, 1}, start);
    if (!found || !refusal_of(*found).empty() || (best && found->pairs <= best->pairs)) continue;
    if (is_found({&shot, found->object_from_rig}, number, {&reference, 1})) best = found;
  }
  return best;
}

/// Tries the known step about each axis of the rig through the middle of the object, either way.
std::optional<Alignment> Tracker::step(const Shot& shot) const {
  std::optional<Alignment> best;
  const ModelFrame& last = frames_.back();
  const PlacedShot reference = last.placed();
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

bool Tracker::is_of_two(const Shot& shot, const RigidTransform& object_from_rig, bool refused) const {
  const auto shows_since = [&](const ModelFrame& before) {
    const std::array starts{before.object_from_rig, expected(), object_from_rig};
    return shows_two_bodies({&shot, object_from_rig}, before.placed(), starts);
  };
  const ModelFrame& before = doubtful_ ? *doubtful_ : frames_.back();
  if (shows_since(before)) return true;
  // Bodies that part slowly moved more since the last keyframe.
  const ModelFrame& keyframe = frames_[keyframes_.back()];
  return refused && &keyframe != &before && shows_since(keyframe);
}

Tracked Tracker::follow(std::size_t number, const Shot& shot) {
  const std::vector<PlacedShot> references = latest_keyframes();
  std::string refusal = "it does not overlap the surface so far";
  double most = 0;
  for (std::size_t first = 0; first < kCellSteps.size(); ++first) {
    for (const RigidTransform& start : {expected(), frames_.back().object_from_rig}) {
      const auto found = align(shot, references, start, first);
      if (!found) continue;
      std::string reason = refusal_of(*found);
      if (reason.empty() && lost_ && !is_found({&shot, found->object_from_rig}, number, references)) continue;
      const double agreeing = found->agreeing * static_cast<double>(found->pairs);
      if (agreeing > most || reason.empty()) most = agreeing, candidate_ = found->object_from_rig;
      if (reason.empty()) return {found, {}, lost_};
      if (first == 0) refusal = std::move(reason);
    }
  }
  if (step_degrees_ > 0) {
    if (const auto found = step(shot)) {
      candidate_ = found->object_from_rig;
      return {found, {}, lost_};
    }
  }
  if (const auto found = search(number, shot)) {
    candidate_ = found->object_from_rig;
    return {found, {}, true};
  }
  return {{}, std::move(refusal), false};
}

Tracked Tracker::add(std::size_t number, Shot shot) {
  if (shot.cells() < kFewestCells) {
    lost_ = !frames_.empty();
    return {
        {},
        "it shows almost nothing: the object left the view, the scan failed, or stride or voxel_mm thinned the cloud",
        false};
  }
  candidate_.reset();
  Tracked tracked = frames_.empty() ? begin(shot) : follow(number, shot);
  if (candidate_ && is_of_two(shot, *candidate_, !tracked.alignment)) {
    for (SurfaceView& view : shot.views) view.image.drop_pixels();
    doubtful_ = {number, std::move(shot), *candidate_};
    lost_ = !frames_.empty();
    return {{}, kTwoBodies, false};
  }
  doubtful_.reset();
  lost_ = !tracked.alignment && !frames_.empty();
  if (!tracked.alignment) return tracked;
  const Alignment& alignment = *tracked.alignment;
  for (SurfaceView& view : shot.views) view.image.drop_pixels();
  frames_.push_back({number, std::move(shot), alignment.object_from_rig});
  const bool is_new =
      keyframes_.empty() || alignment.overlap < kKeyframeOverlap ||
      turn_degrees(frames_[keyframes_.back()].object_from_rig, alignment.object_from_rig) > kKeyframeDegrees;
  if (is_new) add_keyframe();
  return tracked;
}

void Tracker::add_keyframe() {
  const PlacedShot placed = frames_.back().placed();
  ShotEvidence evidence = no_evidence(*placed.shot);
  for (std::size_t i = 0; i < keyframes_.size(); ++i) {
    ModelFrame& before = frames_[keyframes_[i]];
    const PlacedShot other = before.placed();
    weigh(evidence_[i], other, placed);
    weigh(evidence, placed, other);
    mark_foreign(before.shot, evidence_[i]);
  }
  mark_foreign(frames_.back().shot, evidence);
  evidence_.push_back(std::move(evidence));
  keyframes_.push_back(frames_.size() - 1);
}

void Tracker::mark_foreign_cells() {
  const auto witnesses_of = [&](std::size_t frame) {
    std::vector<PlacedShot> witnesses;
    for (const std::size_t keyframe : keyframes_)
      if (keyframe != frame) witnesses.push_back(frames_[keyframe].placed());
    return witnesses;
  };
  std::vector<ShotEvidence> evidence(frames_.size());
  tbb::parallel_for(std::size_t{0}, frames_.size(), [&](std::size_t i) {
    const PlacedShot placed = frames_[i].placed();
    evidence[i] = no_evidence(*placed.shot);
    for (const PlacedShot& witness : witnesses_of(i)) weigh(evidence[i], placed, witness);
  });
  std::vector<std::size_t> marked;
  for (std::size_t i = 0; i < frames_.size(); ++i)
    if (mark_foreign(frames_[i].shot, evidence[i]) > 0) marked.push_back(i);
  // What one frame marks confirms nothing in the next round.
  for (int round = 0; round < kRounds; ++round) {
    std::vector<std::vector<std::vector<std::size_t>>> grown(marked.size());
    tbb::parallel_for(std::size_t{0}, marked.size(), [&](std::size_t i) {
      grown[i] = grown_foreign(frames_[marked[i]].placed(), witnesses_of(marked[i]));
    });
    for (std::size_t i = 0; i < marked.size(); ++i) {
      Shot& shot = frames_[marked[i]].shot;
      for (std::size_t view = 0; view < shot.views.size(); ++view)
        for (const std::size_t cell : grown[i][view]) shot.views[view].levels.back().cells[cell].foreign = true;
      mark_coarse_cells(shot);
    }
  }
}

}  // namespace slsd::model
