// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/scanner.hpp"

#include <spdlog/spdlog.h>

#include <limits>
#include <random>

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
constexpr int kFailuresToPause = 2;

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

Scanner::Scanner(std::unique_ptr<Rig> rig, ScanSetup setup)
    : rig_(std::move(rig)),
      setup_(std::make_shared<ScanSetup>(std::move(setup))),
      queue_(kMaxWaiting),
      run_id_(make_run_id()),
      lanes_(DecodeLanes::lanes_here()) {
  heartbeat_.promise(kIdlePromise);
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Scanner::~Scanner() {
  request_stop();
}

void Scanner::request_stop() {
  thread_.request_stop();
  rig_->request_stop();
  lanes_.request_stop();
}

bool Scanner::wait_stopped(std::chrono::milliseconds time) {
  const auto end = steady_clock::now() + time;
  const auto all_stopped = [this] { return stopped_ && lanes_.stopped() && rig_->stopped(); };
  while (!all_stopped() && steady_clock::now() < end) std::this_thread::sleep_for(5ms);
  return all_stopped();
}

void Scanner::run(const std::stop_token& stop) {
  name_this_thread("scanner");
  while (!stop.stop_requested()) {
    heartbeat_.promise(kIdlePromise);
    if (!free_scan_due()) {
      every_frame_ = false;  // by the next free scan the cameras' frames may be of long ago
      rig_->supervise();     // not before a scan: the idle picture would only flash
    }
    if (auto job = queue_.pop_until(next_wake(), stop)) {
      every_frame_ = false;
      (*job)({});
    } else if (free_scan_due()) {
      scan_freely();
    }
  }
  refuse_waiting();
  stopped_ = true;
}

bool Scanner::free_scan_due() const {
  return free_rate_hz_ > 0 && steady_clock::now() >= next_free_scan_;
}

void Scanner::refuse_waiting() {
  while (auto job = queue_.try_pop()) (*job)(fail(ErrorCode::kCancelled, "the service is stopping"));
}

MonotonicTime Scanner::next_wake() const {
  const MonotonicTime idle = std::min<MonotonicTime>(steady_clock::now() + kIdleWake, rig_->next_change());
  return free_rate_hz_ > 0 ? std::min(idle, next_free_scan_) : idle;
}

void Scanner::submit(Job job) {
  if (!queue_.try_push(std::move(job))) {
    job(fail(ErrorCode::kBusy, std::to_string(kMaxWaiting) + " requests wait already: ask again later"));
  }
}

// Where the frames under way are all that a camera lends, its next waits for one of them.
template <class Take>
auto Scanner::take_frames(MonotonicTime deadline, Take take) {
  while (true) {
    const std::uint64_t done = lanes_.done();
    auto taken = take();
    const bool lacks_frames = !taken && taken.error().code == ErrorCode::kBusy;
    if (!lacks_frames || !lanes_.wait_done(done, deadline)) return taken;
  }
}

Result<FrameSet> Scanner::capture(const ScanRequest& request, Exposure exposure) {
  heartbeat_.promise(request.deadline - steady_clock::now() + kWorkPromise);
  if (auto possible = setup_->check(request); !possible) return tl::unexpected(possible.error());
  return take_frames(request.deadline, [&]() -> Result<FrameSet> {
    auto set = rig_->capture(request.deadline, exposure, {request.texture, request.ambient});
    if (!set) return set;
    if (auto same = hardware_.check(setup_, *rig_); !same) return tl::unexpected(same.error());
    return set;
  });
}

std::unique_ptr<ScanJob> Scanner::decoding(Result<FrameSet> set, const ScanRequest& request, bool listened,
                                           Answer<ScanResult> answer) {
  const std::uint64_t number = ++scans_;
  const std::string scan_id = run_id_ + "-" + std::to_string(number);
  auto told = [this, setup = setup_, number, scan_id, listened, answer = std::move(answer)](Result<ScanResult> result) {
    conclude(setup, number, scan_id, result);
    if (answer) answer(result);
    if (listened && listener_) listener_(std::make_shared<Result<ScanResult>>(std::move(result)));
  };
  return std::make_unique<ScanJob>(std::move(set), setup_, request, scan_id, std::move(told));
}

void Scanner::conclude(const SharedSetup& setup, std::uint64_t number, const std::string& scan_id,
                       Result<ScanResult>& result) {
  const std::uint64_t skipped = lanes_.skipped();
  const std::uint64_t skipped_now = skipped - std::exchange(skipped_told_, skipped);
  if (result) result->skipped = skipped_now;
  statistics_.note(result, skipped_now);
  if (result) watch_.note(setup, *result, number);
  log_outcome(scan_id, result);
}

void Scanner::log_outcome(const std::string& scan_id, const Result<ScanResult>& result) {
  if (result) {
    spdlog::debug("scan {}: {} points, capture {:.1f} ms, decode {:.1f} ms", scan_id, result->cloud.points.size(),
                  milliseconds(result->capture_time), milliseconds(result->decode_time));
    if (failures_in_a_row_ > 0) spdlog::info("scan {}: scans succeed again", scan_id);
  } else {
    const auto level = failures_in_a_row_ > 0 ? spdlog::level::debug : spdlog::level::info;
    spdlog::log(level, "scan {} failed ({}): {}", scan_id, to_string(result.error().code), to_string(result.error()));
  }
  failures_in_a_row_ = result ? 0 : failures_in_a_row_ + 1;
}

void Scanner::scan(const ScanRequest& request, Answer<ScanResult> answer) {
  submit([this, request, answer = std::move(answer)](const Result<>& permission) {
    if (!permission) return answer(tl::unexpected(permission.error()));
    if (steady_clock::now() >= request.deadline) {
      return answer(fail(ErrorCode::kTimeout, "other requests took all of its time: allow a longer timeout"));
    }
    lanes_.push(decoding(capture(request, Exposure::kFresh), request, free_rate_hz_ > 0, answer));
  });
}

void Scanner::frame(const FrameRequest& request, Answer<FrameImage> answer) {
  submit([this, request, answer = std::move(answer)](const Result<>& permission) {
    if (!permission) return answer(tl::unexpected(permission.error()));
    heartbeat_.promise(request.deadline - steady_clock::now() + kWorkPromise);
    if (auto known = setup_->check_camera(request.camera); !known) return answer(tl::unexpected(known.error()));
    const std::size_t camera = setup_->camera_index(request.camera);
    auto frame =
        take_frames(request.deadline, [&] { return rig_->capture_one(camera, request.deadline, request.as_shown); });
    if (!frame) return answer(tl::unexpected(frame.error()));
    lanes_.push(std::make_unique<ImageJob>(std::move(*frame), request.as_png, answer));
  });
}

void Scanner::project(const ProjectRequest& request, Answer<void> answer) {
  submit([this, request, answer = std::move(answer)](const Result<>& permission) {
    if (!permission) return answer(permission);
    heartbeat_.promise(request.deadline - steady_clock::now() + kWorkPromise);
    if (request.picture == ProjectedPicture::kIdle) return answer(rig_->release(request.deadline));
    auto drawn = draw_projected(request.picture, request.png, *setup_);
    if (!drawn) return answer(tl::unexpected(drawn.error()));
    answer(rig_->hold(std::move(*drawn), request.deadline));
  });
}

void Scanner::pattern(Answer<std::string> answer) {
  submit([this, answer = std::move(answer)](const Result<>& permission) {
    if (!permission) return answer(tl::unexpected(permission.error()));
    heartbeat_.promise(kWorkPromise);
    answer(encode_png(setup_->image));
  });
}

void Scanner::files(Answer<ScanFiles> answer) {
  submit([this, answer = std::move(answer)](const Result<>& permission) {
    if (!permission) return answer(tl::unexpected(permission.error()));
    heartbeat_.promise(kWorkPromise);
    answer(setup_->files());
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
    auto setup = ScanSetup::create(with_devices, DecodeLanes::lanes_here());
    if (!setup) return answer(tl::unexpected(setup.error()));
    setup_ = std::make_shared<ScanSetup>(std::move(*setup));
    rig_->show(setup_->image);
    answer(configuration);
  });
}

void Scanner::run_freely(std::optional<double> rate_hz) {
  free_rate_hz_ = rate_hz.value_or(0);
  queue_.wake();
}

void Scanner::scan_freely() {
  const MonotonicTime begin = steady_clock::now();
  const double rate_hz = free_rate_hz_;
  const ScanRequest request{begin + kFreeScanTimeout, false, {}};
  auto set = capture(request, every_frame_ ? Exposure::kNext : Exposure::kFresh);
  const bool taken = set.has_value();
  auto job = decoding(std::move(set), request, true, {});
  taken ? lanes_.offer(std::move(job)) : lanes_.push(std::move(job));
  const auto period = std::chrono::duration<double>(rate_hz > 0 ? 1.0 / rate_hz : 0.0);
  next_free_scan_ = begin + std::chrono::duration_cast<std::chrono::nanoseconds>(period);
  const MonotonicTime now = steady_clock::now();
  if (failures_in_a_row_ >= kFailuresToPause)
    next_free_scan_ = std::max<MonotonicTime>(next_free_scan_, now + kPauseAfterFailure);
  every_frame_ = next_free_scan_ <= now;
}

}  // namespace slsd
