// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/scanner.hpp"

#include <spdlog/spdlog.h>

#include <limits>
#include <random>

#include "daemon/rpc/rpc_error.hpp"
#include "daemon/scan/thread_name.hpp"
#include "drivers/files/encode_png.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr std::size_t kMaxWaiting = 64;
constexpr auto kIdleWake = 1s;
constexpr auto kIdlePromise = 10s;
constexpr auto kWorkPromise = 60s;  // decoding, drawing, or making a pattern
constexpr auto kFreeScanTimeout = 5s;
constexpr auto kPauseAfterFailure = 500ms;

// Tells the scans of one run of the service from those of another.
std::string make_run_id() {
  std::random_device source;
  char text[9];
  std::snprintf(text, sizeof text, "%08x", source());
  return text;
}

double milliseconds(std::chrono::nanoseconds time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

}  // namespace

Scanner::Scanner(std::unique_ptr<Rig> rig) : rig_(std::move(rig)), queue_(kMaxWaiting), run_id_(make_run_id()) {
  heartbeat_.promise(kIdlePromise);
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Scanner::~Scanner() {
  request_stop();
}

void Scanner::request_stop() {
  thread_.request_stop();
  rig_->request_stop();
}

bool Scanner::wait_stopped(std::chrono::milliseconds time) {
  const auto end = steady_clock::now() + time;
  while (!stopped_ && steady_clock::now() < end) std::this_thread::sleep_for(5ms);
  return stopped_;
}

void Scanner::run(const std::stop_token& stop) {
  name_this_thread("scanner");
  while (!stop.stop_requested()) {
    heartbeat_.promise(kIdlePromise);
    rig_->supervise();
    if (auto job = queue_.pop_until(next_wake(), stop)) {
      (*job)({});
    } else if (free_rate_hz_ > 0 && steady_clock::now() >= next_free_scan_) {
      scan_freely(stop);
    }
  }
  refuse_waiting();
  stopped_ = true;
}

void Scanner::refuse_waiting() {
  while (auto job = queue_.try_pop()) (*job)(fail(ErrorCode::kCancelled, "the service is stopping"));
}

MonotonicTime Scanner::next_wake() const {
  const MonotonicTime idle = steady_clock::now() + kIdleWake;
  return free_rate_hz_ > 0 ? std::min(idle, next_free_scan_) : idle;
}

void Scanner::submit(Job job) {
  Job refused = job;
  if (!queue_.try_push(std::move(job))) {
    refused(fail(ErrorCode::kBusy, std::to_string(kMaxWaiting) + " requests wait already: ask again later"));
  }
}

Result<ScanResult> Scanner::transact(const ScanRequest& request) {
  heartbeat_.promise(request.deadline - steady_clock::now() + kWorkPromise);
  const std::string scan_id = run_id_ + "-" + std::to_string(++scans_);
  auto result = rig_->scan(request, scan_id);
  statistics_.note(result);
  log_outcome(scan_id, result);
  return result;
}

void Scanner::log_outcome(const std::string& scan_id, const Result<ScanResult>& result) {
  if (result) {
    spdlog::debug("scan {}: {} points, capture {:.1f} ms, decode {:.1f} ms", scan_id, result->cloud.points.size(),
                  milliseconds(result->capture_time), milliseconds(result->decode_time));
    if (failing_) spdlog::info("scan {}: scans succeed again", scan_id);
  } else {
    const auto level = failing_ ? spdlog::level::debug : spdlog::level::info;
    spdlog::log(level, "scan {} failed ({}): {}", scan_id, to_string(result.error().code), to_string(result.error()));
  }
  failing_ = !result;
}

void Scanner::scan(const ScanRequest& request, Answer<ScanResult> answer) {
  submit([this, request, answer = std::move(answer)](const Result<>& permission) {
    if (!permission) return answer(tl::unexpected(permission.error()));
    if (steady_clock::now() >= request.deadline) {
      return answer(fail(ErrorCode::kTimeout, "other requests took all of its time: allow a longer timeout"));
    }
    auto result = std::make_shared<Result<ScanResult>>(transact(request));
    if (free_rate_hz_ > 0 && listener_) listener_(result);
    answer(*result);
  });
}

void Scanner::frame(const std::string& camera, bool as_png, MonotonicTime deadline, Answer<FrameImage> answer) {
  submit([this, camera, as_png, deadline, answer = std::move(answer)](const Result<>& permission) {
    if (!permission) return answer(tl::unexpected(permission.error()));
    heartbeat_.promise(deadline - steady_clock::now() + kWorkPromise);
    answer(rig_->frame(camera, as_png, deadline));
  });
}

void Scanner::pattern(Answer<std::string> answer) {
  submit([this, answer = std::move(answer)](const Result<>& permission) {
    if (!permission) return answer(tl::unexpected(permission.error()));
    heartbeat_.promise(kWorkPromise);
    answer(encode_png(rig_->setup().image));
  });
}

void Scanner::reload(const std::filesystem::path& file, const Configuration& running, Answer<Configuration> answer) {
  submit([this, file, running, answer = std::move(answer)](const Result<>& permission) {
    if (!permission) return answer(tl::unexpected(permission.error()));
    heartbeat_.promise(kWorkPromise);
    auto configuration = load_configuration(file);
    if (!configuration) return answer(configuration);
    Configuration with_devices = *configuration;
    with_devices.projector = running.projector;
    with_devices.pattern.projector_width_px = running.projector.width_px;
    with_devices.pattern.projector_height_px = running.projector.height_px;
    with_devices.cameras = running.cameras;
    auto setup = ScanSetup::create(with_devices);
    if (!setup) return answer(tl::unexpected(setup.error()));
    rig_->replace(std::move(*setup));
    answer(configuration);
  });
}

void Scanner::run_freely(std::optional<double> rate_hz) {
  free_rate_hz_ = rate_hz.value_or(0);
  queue_.wake();
}

void Scanner::scan_freely(const std::stop_token& stop) {
  const MonotonicTime begin = steady_clock::now();
  const double rate_hz = free_rate_hz_;
  auto result = std::make_shared<Result<ScanResult>>(transact({begin + kFreeScanTimeout, false, {}}));
  const auto period = std::chrono::duration<double>(rate_hz > 0 ? 1.0 / rate_hz : 0.0);
  next_free_scan_ = begin + std::chrono::duration_cast<std::chrono::nanoseconds>(period);
  if (!*result) next_free_scan_ = std::max(next_free_scan_, MonotonicTime(steady_clock::now() + kPauseAfterFailure));
  if (!stop.stop_requested() && listener_) listener_(std::move(result));
}

}  // namespace slsd
