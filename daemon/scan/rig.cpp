// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/rig.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <thread>

#include "daemon/scan/frame_image.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

std::string utc_time(MonotonicTime time) {
  const auto when = std::chrono::system_clock::now() - (steady_clock::now() - time);
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(when.time_since_epoch()).count();
  const std::time_t seconds = ms / 1000;
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[40];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &parts);
  char fraction[8];
  std::snprintf(fraction, sizeof fraction, ".%03dZ", static_cast<int>(ms % 1000));
  return std::string(text) + fraction;
}

void append(const Decoding& decoding, ScanResult& result) {
  result.cloud.points.insert(result.cloud.points.end(), decoding.points.begin(), decoding.points.end());
  for (std::size_t i = 0; i < decoding.counts.size(); ++i) result.regions[i] += decoding.counts[i];
}

}  // namespace

Rig::Rig(std::unique_ptr<Projector> projector, std::vector<std::unique_ptr<Camera>> cameras, ScanSetup setup,
         const ScanOptions& options)
    : projector_(std::move(projector)), setup_(std::move(setup)), options_(options), backoff_(options) {
  const ProjectorDescription& description = projector_->description();
  projector_status_.name = "projector";
  projector_status_.driver = description.driver;
  projector_status_.device = description.monitor;
  projector_status_.width_px = description.width_px;
  projector_status_.height_px = description.height_px;
  for (auto& camera : cameras) cameras_.push_back(std::make_unique<CameraRunner>(std::move(camera), options));
}

void Rig::request_stop() {
  stopping_.request_stop();
  for (auto& camera : cameras_) camera->request_stop();
}

DeviceStatus Rig::projector_status() const {
  const std::lock_guard lock(mutex_);
  return projector_status_;
}

std::vector<DeviceStatus> Rig::camera_statuses() const {
  std::vector<DeviceStatus> statuses;
  for (const auto& camera : cameras_) statuses.push_back(camera->status());
  return statuses;
}

void Rig::replace(ScanSetup setup) {
  setup_ = std::move(setup);
  shown_ = false;
}

Result<> Rig::open_projector() {
  if (projector_status().state != DeviceState::kReady) {
    if (auto opened = projector_->open(); !opened) return opened;
  }
  const auto visible = projector_->show(setup_.image);
  if (!visible) return tl::unexpected(visible.error());
  visible_ = *visible;
  return {};
}

void Rig::supervise() {
  if (shown_ || steady_clock::now() < next_attempt_) return;
  const Result<> opened = open_projector();
  shown_ = opened.has_value();
  note_projector(opened);
  if (opened) {
    backoff_.reset();
  } else {
    next_attempt_ = steady_clock::now() + backoff_.next();
  }
}

void Rig::note_projector(const Result<>& opened) {
  const std::lock_guard lock(mutex_);
  DeviceStatus& status = projector_status_;
  if (!opened) {
    if (status.problem.empty()) spdlog::warn("projector: {}; trying again until it opens", to_string(opened.error()));
    status.state = DeviceState::kFailed;
    status.problem = to_string(opened.error());
    return;
  }
  if (!status.problem.empty()) spdlog::info("projector: open again");
  if (status.state != DeviceState::kReady) ++status.opened;
  status.state = DeviceState::kReady;
  status.problem.clear();
}

Result<> Rig::show_pattern(MonotonicTime deadline) {
  supervise();
  while (!shown_) {
    if (stopping_.stop_requested()) return fail(ErrorCode::kCancelled, "the service is stopping");
    if (steady_clock::now() >= deadline) {
      return fail(ErrorCode::kTimeout, "the projector did not become ready in time: " + projector_status().problem,
                  "projector");
    }
    std::this_thread::sleep_until(std::min<MonotonicTime>(deadline, steady_clock::now() + 10ms));
    supervise();
  }
  if (visible_ > deadline) return fail(ErrorCode::kTimeout, "the pattern is not visible in time", "projector");
  std::this_thread::sleep_until(visible_);
  return {};
}

Result<std::size_t> Rig::find_camera(const std::string& name) const {
  if (cameras_.empty()) {
    return fail(ErrorCode::kNotFound, "no camera is configured: add a [[camera]] table to the configuration");
  }
  if (name.empty()) return std::size_t{0};
  std::string names;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    const std::string camera = cameras_[i]->status().name;
    if (camera == name) return i;
    names += (names.empty() ? "" : ", ") + camera;
  }
  return fail(ErrorCode::kNotFound, "no camera is called \"" + name + "\"; there are: " + names);
}

Result<std::vector<Frame>> Rig::capture(const std::vector<std::size_t>& cameras, MonotonicTime deadline) {
  if (auto shown = show_pattern(deadline); !shown) return tl::unexpected(shown.error());
  for (const std::size_t camera : cameras) {
    if (auto ready = cameras_[camera]->wait_ready(deadline); !ready) return tl::unexpected(ready.error());
  }
  const MonotonicTime trigger = steady_clock::now();
  for (const std::size_t camera : cameras) cameras_[camera]->begin_capture(deadline);
  std::vector<Frame> frames;
  Result<> outcome;
  for (const std::size_t camera : cameras) {
    auto frame = cameras_[camera]->end_capture();
    if (frame) {
      frames.push_back(std::move(*frame));
    } else if (outcome) {
      outcome = tl::unexpected(frame.error());
    }
  }
  if (outcome) outcome = check_frames(cameras, frames, trigger, deadline);
  if (!outcome) return tl::unexpected(outcome.error());
  return frames;
}

Result<> Rig::check_frames(const std::vector<std::size_t>& cameras, const std::vector<Frame>& frames,
                           MonotonicTime trigger, MonotonicTime deadline) const {
  MonotonicTime first = MonotonicTime::max();
  MonotonicTime last = MonotonicTime::min();
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::string where = "camera " + cameras_[cameras[i]]->status().name;
    if (frames[i].exposure_start() < trigger) {
      return fail(ErrorCode::kFrameStale, "the frame was exposed before the scan's trigger: scan again", where);
    }
    if (frames[i].received() > deadline) {
      return fail(ErrorCode::kFrameLate, "the frame came after the deadline: allow a longer timeout", where);
    }
    first = std::min(first, frames[i].exposure_start());
    last = std::max(last, frames[i].exposure_start());
  }
  if (frames.size() > 1 && last - first > std::chrono::milliseconds(options_.exposure_skew_ms)) {
    return fail(ErrorCode::kMismatch,
                "the cameras exposed at different times, more than [scan] exposure_skew_ms apart: check the trigger");
  }
  return {};
}

Result<> Rig::decode(const std::vector<Frame>& frames, const ScanRequest& request, ScanResult& result) {
  const auto pictured = find_camera(request.camera);
  if (!pictured) return tl::unexpected(pictured.error());
  StageClock clock;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    clock.start();
    const auto begin = steady_clock::now();
    const auto decoding = setup_.decoders[i].decode(frames[i].image(), &clock);
    result.decode_time += steady_clock::now() - begin;
    if (!decoding) {
      return fail(decoding.error().code, decoding.error().message, "camera " + cameras_[i]->status().name);
    }
    append(**decoding, result);
    if (!request.picture || i != *pictured) continue;
    auto picture = picture_of(frames[i].image(), **decoding, setup_.pattern);
    if (!picture) return tl::unexpected(picture.error());
    result.picture_png = std::move(*picture);
  }
  result.stage_times = clock.times();
  return {};
}

Result<ScanResult> Rig::scan(const ScanRequest& request, const std::string& scan_id) {
  if (auto camera = find_camera(request.camera); !camera) return tl::unexpected(camera.error());
  if (!setup_.calibration) {
    return fail(ErrorCode::kNotFound, "no calibration: name its file as [calibration] file in the configuration");
  }
  std::vector<std::size_t> all(cameras_.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
  const auto begin = steady_clock::now();
  const auto frames = capture(all, request.deadline);
  if (!frames) return tl::unexpected(frames.error());
  ScanResult result;
  result.capture_time = steady_clock::now() - begin;
  result.cloud.lattice_columns = setup_.pattern.whole_columns();
  result.cloud.lattice_rows = setup_.pattern.whole_rows();
  result.cloud.cameras = static_cast<int>(setup_.calibration->cameras.size());
  result.cloud.scan_id = scan_id;
  result.cloud.time = utc_time(frames->front().exposure_start());
  result.cloud.frame = frames->front().sequence();
  if (auto decoded = decode(*frames, request, result); !decoded) return tl::unexpected(decoded.error());
  return result;
}

Result<FrameImage> Rig::frame(const std::string& camera, bool as_png, MonotonicTime deadline) {
  const auto index = find_camera(camera);
  if (!index) return tl::unexpected(index.error());
  const auto frames = capture({*index}, deadline);
  if (!frames) return tl::unexpected(frames.error());
  return as_png ? png_of(frames->front()) : raw_of(frames->front());
}

}  // namespace slsd
