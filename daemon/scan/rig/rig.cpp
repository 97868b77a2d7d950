// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/rig/rig.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "core/duration.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr std::size_t kAlignTriesMax = 32;
// A driver answers by its deadline. One that does not is cancelled a little later, and then abandoned.
constexpr auto kLate = 300ms;
constexpr auto kCancelTime = 400ms;
constexpr auto kHangUpTime = 1s;  // if nobody waits for the frame any more

std::string milliseconds_text(std::chrono::nanoseconds time) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f ms", in_ms(time));
  return text;
}

auto exposures(std::span<const Frame> frames) {
  return std::ranges::minmax_element(frames, {}, &Frame::exposure_start);
}

std::chrono::nanoseconds skew_of(std::span<const Frame> frames) {
  const auto [first, last] = exposures(frames);
  return last->exposure_start() - first->exposure_start();
}

// An error of one camera is the error of the set.
Error incomplete(Error error, std::size_t cameras) {
  if (cameras > 1 && error.code != ErrorCode::kCancelled) {
    error.message = "the set of " + std::to_string(cameras) + " frames is incomplete: " + error.message;
  }
  return error;
}

}  // namespace

Rig::Rig(std::unique_ptr<Projector> projector, std::vector<std::unique_ptr<Camera>> cameras, Grey8 image,
         const ScanOptions& options, const std::vector<std::vector<double>>& exposures_us, std::size_t texture_cameras)
    : projection_(std::move(projector), std::move(image), options),
      measuring_(cameras.size() - texture_cameras),
      options_(options) {
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    auto exposures = i < exposures_us.size() ? exposures_us[i] : std::vector<double>();
    runners_.push_back(std::make_unique<CameraRunner>(std::move(cameras[i]), options, std::move(exposures)));
    cameras_.push_back(runners_.back().get());
    if (!cameras_.back()->exposures_us().empty()) of_two_exposures_.push_back(cameras_.back());
  }
}

void Rig::request_stop() {
  stopping_.request_stop();
  for (CameraRunner* camera : cameras_) camera->request_stop();
}

bool Rig::stopped() const {
  return std::ranges::all_of(cameras_, &CameraRunner::stopped);
}

bool Rig::kept(MonotonicTime now) const {
  return std::ranges::all_of(cameras_, [now](const CameraRunner* camera) { return camera->heartbeat().kept(now); });
}

std::vector<DeviceStatus> Rig::camera_statuses() const {
  std::vector<DeviceStatus> statuses;
  for (const CameraRunner* camera : cameras_) statuses.push_back(camera->status());
  return statuses;
}

std::uint64_t Rig::openings() const {
  std::uint64_t openings = projection_.status().opened;
  for (const CameraRunner* camera : cameras_) openings += camera->openings();
  return openings;
}

// Waits for the projection in steps, because the deadline may be far.
template <class Show>
Result<> Rig::show(const WaitLimit& limit, Show show) {
  limit.note("projector");
  for (;;) {
    const MonotonicTime end = limit.step(limit.deadline);
    auto shown = show(end);
    const bool out_of_time = !shown && shown.error().code == ErrorCode::kTimeout;
    if (!out_of_time || end >= limit.deadline) return shown;
    if (stopping_.stop_requested()) return fail(ErrorCode::kCancelled, "the service is stopping");
  }
}

Result<> Rig::hold(const std::optional<Grey8>& picture, const WaitLimit& limit) {
  return show(limit, [&](MonotonicTime end) { return projection_.hold(picture, end, limit.over); });
}

Result<> Rig::release(const WaitLimit& limit) {
  return show(limit, [&](MonotonicTime end) { return projection_.release(end, limit.over); });
}

Result<std::vector<Frame>> Rig::collect(Cameras cameras, const WaitLimit& limit) {
  for (CameraRunner* camera : cameras) {
    limit.note("camera " + camera->name());
    if (!camera->wait_captured(limit, limit.deadline + kLate)) break;
  }
  for (CameraRunner* camera : cameras) camera->cancel_capture();
  const WaitLimit last(steady_clock::now() + (limit.over.stop_requested() ? kHangUpTime : kCancelTime));
  std::vector<Frame> frames;
  frames.reserve(cameras.size());
  Result<> outcome;
  for (CameraRunner* camera : cameras) {
    (void)camera->wait_captured(last, last.deadline);
    auto frame = camera->end_capture();
    if (frame) {
      frames.push_back(std::move(*frame));
    } else if (outcome) {
      limit.note("camera " + camera->name());
      outcome = tl::unexpected(incomplete(frame.error(), cameras.size()));
    }
  }
  if (!outcome) return tl::unexpected(outcome.error());
  return frames;
}

Result<std::vector<Frame>> Rig::expose(Cameras cameras, const Shot& shot) {
  for (CameraRunner* camera : cameras) {
    shot.limit.note("camera " + camera->name());
    if (auto ready = camera->wait_ready(shot.limit); !ready) return tl::unexpected(ready.error());
  }
  const MonotonicTime since = shot.exposure == Exposure::kNext ? projection_.visible() : steady_clock::now();
  for (CameraRunner* camera : cameras)
    camera->begin_capture(shot.limit.deadline, shot.exposure, shot.light, shot.round);
  auto frames = collect(cameras, shot.limit);
  if (!frames) return frames;
  Result<> outcome = check_times(cameras, *frames, since, shot.limit.deadline);
  if (outcome) outcome = projection_.check(shot.limit.deadline);
  if (!outcome) return tl::unexpected(outcome.error());
  return frames;
}

Result<std::vector<Frame>> Rig::take_set(Cameras cameras, const Shot& shot) {
  const auto shown =
      show(shot.limit, [&](MonotonicTime end) { return projection_.show(shot.light, end, shot.limit.over); });
  if (!shown) return tl::unexpected(shown.error());
  const bool going_on = std::exchange(changes_before_, projection_.changes()) == projection_.changes();
  // After another exposure, the next frame may still have the one before.
  const bool may_have_begun = going_on && of_two_exposures_.empty();
  auto frames =
      expose(cameras, {shot.limit, may_have_begun ? shot.exposure : Exposure::kFresh, shot.light, shot.round});
  if (!frames) return frames;
  // The scene stands still for a texture camera: it need not expose together with the others.
  const Cameras together = cameras.first(std::min(cameras.size(), measuring_));
  const std::span of_these = std::span(*frames).first(together.size());
  if (auto aligned = align(together, of_these, shot); !aligned) return tl::unexpected(aligned.error());
  if (auto fit = check_skew(together, of_these); !fit) return tl::unexpected(fit.error());
  return frames;
}

// A lost frame costs both exposures, so that little time passes between them.
Result<> Rig::take_picture(Cameras cameras, const Shot& shot, FrameSet& set) {
  auto frames = take_set(cameras, shot);
  if (!frames) return tl::unexpected(frames.error());
  const bool pattern = shot.light == Picture::kPattern, white = shot.light == Picture::kWhite;
  LongerFrames& longer = pattern ? set.longer : white ? set.longer_white : set.longer_dark;
  longer.clear();
  if (!of_two_exposures_.empty()) {
    auto second = take_set(of_two_exposures_, {shot.limit, Exposure::kFresh, shot.light, 1});
    if (!second) return tl::unexpected(second.error());
    auto next = second->begin();
    for (const CameraRunner* camera : cameras)
      camera->exposures_us().empty() ? longer.emplace_back() : longer.emplace_back(std::move(*next++));
  }
  (pattern ? set.frames : white ? set.white : set.dark) = std::move(*frames);
  return {};
}

bool Rig::only_replays() const {
  return std::ranges::all_of(measuring(),
                             [](const auto& camera) { return camera->replays() && camera->rate_hz() <= 0; });
}

Result<FrameSet> Rig::capture(const WaitLimit& limit, Exposure exposure, LightFrames light) {
  const auto begin = steady_clock::now();
  FrameSet set;
  for (const Picture now : {Picture::kPattern, Picture::kWhite, Picture::kBlack}) {
    if (now == Picture::kWhite && !light.white) continue;
    if (now == Picture::kBlack && !light.dark) continue;
    const Cameras cameras = light.colour && now != Picture::kPattern ? Cameras(cameras_) : measuring();
    auto taken = take_picture(cameras, {limit, exposure, now}, set);
    while (!taken && limit.again && limit.again(taken.error())) {
      taken = take_picture(cameras, {limit, Exposure::kFresh, now}, set);
    }
    if (!taken) return tl::unexpected(taken.error());
  }
  for (const CameraRunner* camera : measuring()) {
    const std::vector<double>& exposures_us = camera->exposures_us();
    if (!of_two_exposures_.empty())
      set.exposure_ratios.push_back(exposures_us.empty() ? 1 : exposures_us.back() / exposures_us.front());
  }
  set.capture_time = steady_clock::now() - begin;
  set.skew = skew_of(set.frames);
  return set;
}

Result<Frame> Rig::capture_one(std::size_t camera, const WaitLimit& limit, bool as_shown) {
  for (;;) {
    const auto shown = show(limit, [&](MonotonicTime end) {
      return as_shown ? projection_.show_due(end, limit.over) : projection_.show(Picture::kPattern, end, limit.over);
    });
    if (!shown) return tl::unexpected(shown.error());
    auto frames = expose(Cameras(cameras_).subspan(camera, 1), {limit});
    if (frames) return std::move(frames->front());
    if (!limit.again || !limit.again(frames.error())) return tl::unexpected(frames.error());
  }
}

// Cameras in free run begin at any moment of their period. If one began too early for the others, its next frame is
// closer to theirs.
Result<> Rig::align(Cameras cameras, std::span<Frame> frames, const Shot& shot) {
  for (std::size_t tries = 0; frames.size() > 1 && tries < kAlignTriesMax; ++tries) {
    const auto first = static_cast<std::size_t>(&*exposures(frames).min - frames.data());
    if (skew_of(frames) <= slack(*cameras[first])) return {};
    auto next = expose(cameras.subspan(first, 1), {shot.limit, Exposure::kNext, shot.light, shot.round});
    if (!next) return tl::unexpected(next.error());
    frames[first] = std::move(next->front());
  }
  return {};
}

/// The longest time by which this camera may begin before the last of the others while no later frame of it is closer.
std::chrono::nanoseconds Rig::slack(const CameraRunner& camera) const {
  if (camera.rate_hz() <= 0) return std::chrono::nanoseconds::max();
  return std::chrono::nanoseconds(static_cast<std::int64_t>(0.5e9 / camera.rate_hz()));
}

Result<> Rig::check_times(Cameras cameras, const std::vector<Frame>& frames, MonotonicTime since,
                          MonotonicTime deadline) const {
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].exposure_start() < since) {
      return fail(ErrorCode::kFrameStale, "the frame was exposed before the scan's trigger: scan again",
                  "camera " + cameras[i]->name());
    }
    if (frames[i].received() > deadline) {
      return fail(ErrorCode::kFrameLate, "the frame came after the deadline: allow a longer timeout",
                  "camera " + cameras[i]->name());
    }
  }
  return {};
}

Result<> Rig::check_skew(Cameras cameras, std::span<const Frame> frames) const {
  const auto skew = skew_of(frames);
  if (skew <= std::chrono::milliseconds(options_.exposure_skew_ms)) return {};
  const auto [first, last] = exposures(frames);
  return fail(ErrorCode::kFrameSkewed, "camera " + cameras[&*last - frames.data()]->name() + " exposed " +
                                           milliseconds_text(skew) + " after camera " +
                                           cameras[&*first - frames.data()]->name() +
                                           ", more than [scan] exposure_skew_ms: check the trigger");
}

}  // namespace slsd
