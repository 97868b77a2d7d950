// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/scanner.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/duration.hpp"
#include "daemon/configuration/settings_over.hpp"
#include "daemon/scan/message_ids.hpp"
#include "daemon/scan/rig/devices.hpp"
#include "daemon/scan/within_memory.hpp"
#include "drivers/files/encode_png.hpp"
#include "drivers/log/log_field.hpp"
#include "drivers/system/thread_name.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr std::size_t kMaxWaiting = 64;
constexpr std::size_t kMaxChores = 16;
constexpr auto kIdleWake = 1s;
constexpr auto kStepPromise = 7s;  // waits go by steps of one second
constexpr auto kFreeScanTimeout = 5s;
constexpr auto kPauseAfterFailure = 500ms;
constexpr int kFailuresToPause = 2;
constexpr double kReplayRateHz = 10;  // rate of recorded frames if not configured: otherwise they use a whole processor
constexpr auto kTryPauseFirst = 5ms;
constexpr auto kTryPauseLongest = 200ms;

// Distinguishes the scans of this run of the service from those of other runs.
std::string make_run_id() {
  std::random_device source;
  char text[9];
  std::snprintf(text, sizeof text, "%08x", source());
  return text;
}

Error stopping() {
  return {ErrorCode::kCancelled, "the service is stopping", {}};
}

}  // namespace

Scanner::Scanner(std::unique_ptr<Rig> rig, ScanSetup setup, std::size_t black_box_bytes)
    : rig_(std::move(rig)),
      setup_(std::make_shared<ScanSetup>(std::move(setup))),
      adopted_(setup_),
      queue_(kMaxWaiting),
      chores_(kMaxChores),
      black_box_(black_box_bytes),
      run_id_(make_run_id()),
      lanes_(DecodeLanes::lanes_here()),
      deadlines_([this](const Task& task) { return overdue(task); }) {
  heartbeat_.promise(kStepPromise);
  chores_thread_ = std::jthread([this](const std::stop_token& stop) { run_chores(stop); });
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Scanner::~Scanner() {
  request_stop();
}

void Scanner::request_stop() {
  thread_.request_stop();
  chores_thread_.request_stop();
  rig_->request_stop();
  std::shared_ptr<Task> under_way;
  {
    const std::lock_guard lock(mutex_);
    under_way = under_way_;
  }
  if (under_way) under_way->fail_with(stopping());
  lanes_.request_stop();
}

bool Scanner::wait_stopped(std::chrono::milliseconds time) {
  const auto end = steady_clock::now() + time;
  const auto all_stopped = [this] { return running_ == 0 && lanes_.stopped() && rig_->stopped(); };
  while (!all_stopped() && steady_clock::now() < end) std::this_thread::sleep_for(5ms);
  return all_stopped();
}

bool Scanner::kept() const {
  return heartbeat_.kept() && chore_heartbeat_.kept() && lanes_.kept() && rig_->kept();
}

SharedSetup Scanner::setup() const {
  const std::lock_guard lock(mutex_);
  return setup_;
}

// --- the scanner's thread ---

void Scanner::run(const std::stop_token& stop) {
  name_this_thread("scanner");
  while (!stop.stop_requested()) {
    heartbeat_.promise(kStepPromise);
    adopt_setup();
    if (!free_scan_due()) {
      every_frame_ = false;  // by the next free scan the cameras' frames may be old
      rig_->supervise();     // not before a scan: the idle picture would only flash
    }
    if (const auto turn = queue_.pop_until(next_wake(), stop)) {
      every_frame_ = false;
      adopt_setup();
      take_turn(*turn);
    } else if (free_scan_due()) {
      scan_freely();
    }
  }
  while (const auto turn = queue_.try_pop()) turn->task->fail_with(stopping());
  heartbeat_.rest();
  --running_;
}

void Scanner::adopt_setup() {
  SharedSetup setup = this->setup();
  if (setup == adopted_) return;
  adopted_ = std::move(setup);
  rig_->show(adopted_->image);
}

void Scanner::take_turn(const Turn& turn) {
  if (turn.task->over()) return;
  {
    const std::lock_guard lock(mutex_);
    under_way_ = turn.task;
  }
  // A stop before this line could not see the task.
  if (thread_.get_stop_token().stop_requested()) turn.task->fail_with(stopping());
  heartbeat_.promise(kStepPromise);
  within_memory(turn.take, [&] { turn.task->fail_with(out_of_memory()); });
  const std::lock_guard lock(mutex_);
  under_way_.reset();
}

bool Scanner::free_scan_due() const {
  return free_rate_hz_ > 0 && steady_clock::now() >= next_free_scan_;
}

MonotonicTime Scanner::next_wake() const {
  const MonotonicTime idle = std::min<MonotonicTime>(steady_clock::now() + kIdleWake, rig_->next_change());
  return free_rate_hz_ > 0 ? std::min(idle, next_free_scan_) : idle;
}

void Scanner::scan_freely() {
  const MonotonicTime begin = steady_clock::now();
  const double wanted_hz = free_rate_hz_;
  const double rate_hz = std::isinf(wanted_hz) && rig_->only_replays() ? kReplayRateHz : wanted_hz;
  ScanRequest request;
  request.deadline = begin + kFreeScanTimeout, request.of_stream = true;
  const auto scan = make_scan(std::move(request), true, {});
  take_turn({scan, [&] {
               WaitLimit limit = limit_of(*scan);
               limit.again = wait_for_frames(*scan);
               scan->expose(*rig_, hardware_, adopted_, limit, every_frame_ ? Exposure::kNext : Exposure::kFresh,
                            free_formats_);
             }});
  heartbeat_.promise(kWorkPromise);
  scan->exposed() ? lanes_.offer(scan) : lanes_.push(scan);
  const auto period = std::chrono::duration<double>(rate_hz > 0 ? 1.0 / rate_hz : 0.0);
  next_free_scan_ = begin + std::chrono::duration_cast<std::chrono::nanoseconds>(period);
  const MonotonicTime now = steady_clock::now();
  if (failures_in_a_row_ >= kFailuresToPause)
    next_free_scan_ = std::max<MonotonicTime>(next_free_scan_, now + kPauseAfterFailure);
  every_frame_ = next_free_scan_ <= now;
}

WaitLimit Scanner::limit_of(Task& task) {
  WaitLimit limit = task.limit();
  limit.alive = [this] { heartbeat_.promise(kStepPromise); };
  return limit;
}

// If the frames under way are all that the camera lends, its next capture waits for one of them.
std::function<bool(const Error&)> Scanner::wait_for_frames(Task& task) {
  return [this, &task, done = lanes_.done()](const Error& error) mutable {
    if (error.code != ErrorCode::kBusy || !lanes_.wait_done(done, limit_of(task))) return false;
    done = lanes_.done();
    return true;
  };
}

// Takes lost frames again. The pauses keep a camera that loses every frame at once from using a whole processor.
std::function<bool(const Error&)> Scanner::try_again(Task& task, std::function<void(const Error&)> note) {
  return [&task, lent = wait_for_frames(task), note = std::move(note),
          pause = std::chrono::milliseconds::zero()](const Error& error) mutable {
    if (lent(error)) return true;
    if (!may_be_taken_again(error) || steady_clock::now() + pause >= task.deadline()) return false;
    note(error);
    task.pause(pause);
    pause = std::clamp<std::chrono::milliseconds>(2 * pause, kTryPauseFirst, kTryPauseLongest);
    return !task.over();
  };
}

// --- requests ---

void Scanner::submit(Turn turn, const std::stop_token& gone) {
  const std::shared_ptr<Task> task = turn.task;
  deadlines_.watch(task);
  task->end_with(gone);
  // Removes finished requests to make room.
  queue_.erase_if([](const Turn& each) { return each.task->over(); });
  if (queue_.try_push(std::move(turn))) {
    if (thread_.get_stop_token().stop_requested()) task->fail_with(stopping());
    return;
  }
  task->fail_with(
      {ErrorCode::kBusy, std::to_string(kMaxWaiting) + " requests are waiting already: try again later", {}});
}

Error Scanner::overdue(const Task& task) const {
  std::string holder = task.waits_for();
  const bool had_its_turn = !holder.empty();
  if (!had_its_turn) {
    const std::lock_guard lock(mutex_);
    if (under_way_) holder = under_way_->waits_for();
  }
  if (holder.empty()) {
    return {ErrorCode::kTimeout, "other requests used up its time: allow a longer timeout", {}};
  }
  const RigStatus rig = rig_->status();
  std::string problem = holder == "projector" ? rig.projector.problem : "";
  for (const DeviceStatus& camera : rig.cameras) {
    if (holder == "camera " + camera.name) problem = camera.problem;
  }
  std::string message = had_its_turn ? "the scan timed out here: raise timeout_ms"
                                     : "the scan timed out: an earlier request is still waiting here";
  if (!problem.empty()) message += "; " + problem;
  return {ErrorCode::kTimeout, std::move(message), std::move(holder)};
}

std::shared_ptr<Scan> Scanner::make_scan(ScanRequest request, bool listened, Answer<ScanResult> answer) {
  const std::uint64_t number = ++scans_;
  Scan::Keep keep;
  if (black_box_.bytes_max() > 0) {
    keep = [this](const Scan& scan, const FrameSet& set) {
      black_box_.keep_frames(scan.id(), set, scan.setup(), scan.request());
    };
  }
  return std::make_shared<Scan>(
      std::move(request), number, run_id_ + "-" + std::to_string(number),
      [this, listened, answer = std::move(answer)](const Scan& scan, Result<ScanResult> result) {
        conclude(scan, result);
        if (answer) answer(result);
        const bool for_all = listened && (result || result.error().code != ErrorCode::kCancelled);
        if (!for_all || !listener_) return;
        if (result) result->frames = {}, result->picture_png = {};  // large, and for one client alone
        listener_(std::make_shared<Result<ScanResult>>(std::move(result)));
      },
      std::move(keep));
}

void Scanner::scan(ScanRequest request, Answer<ScanResult> answer) {
  const std::stop_token gone = request.gone;
  auto scan = make_scan(std::move(request), free_rate_hz_ > 0, std::move(answer));
  submit({scan,
          [this, scan] {
            WaitLimit limit = limit_of(*scan);
            limit.again = try_again(*scan, [&](const Error& error) { scan->note_lost(error); });
            scan->expose(*rig_, hardware_, adopted_, limit, Exposure::kFresh, free_formats_);
            limit.note("decoding");
            heartbeat_.promise(kWorkPromise);
            lanes_.push(scan);
          }},
         gone);
}

void Scanner::frame(FrameRequest request, Answer<FrameImage> answer) {
  const std::stop_token gone = request.gone;
  auto frame = std::make_shared<FrameTask>(std::move(request), std::move(answer));
  submit({frame,
          [this, frame] {
            WaitLimit limit = limit_of(*frame);
            limit.again = try_again(*frame, [](const Error&) {});
            frame->expose(*rig_, *adopted_, limit);
            limit.note("decoding");
            heartbeat_.promise(kWorkPromise);
            lanes_.push(frame);
          }},
         gone);
}

void Scanner::project(ProjectRequest request, Answer<void> answer) {
  const std::stop_token gone = request.gone;
  auto task = std::make_shared<TaskOf<void>>(request.deadline, std::move(answer));
  submit({task,
          [this, task, request = std::move(request)] {
            const WaitLimit limit = limit_of(*task);
            if (request.picture == Picture::kIdle) return task->end(rig_->release(limit));
            heartbeat_.promise(kWorkPromise);
            auto drawn = draw_projected(request.picture, request.png, *adopted_, request.deadline);
            task->end(drawn ? rig_->hold(*drawn, limit) : tl::unexpected(drawn.error()));
          }},
         gone);
}

// --- what needs no device ---

void Scanner::run_chores(const std::stop_token& stop) {
  name_this_thread("chores");
  while (!stop.stop_requested()) {
    const auto chore = chores_.pop_until(steady_clock::now() + 1h, stop);
    if (!chore) continue;
    chore_heartbeat_.promise(kWorkPromise);
    within_memory([&] { (*chore)({}); }, [&] { (*chore)(tl::unexpected(out_of_memory())); });
    chore_heartbeat_.rest();
  }
  refuse_chores();
  --running_;
}

void Scanner::refuse_chores() {
  while (const auto chore = chores_.try_pop()) (*chore)(tl::unexpected(stopping()));
}

void Scanner::submit_chore(Chore chore) {
  if (!chores_.try_push(std::move(chore))) {
    // What found no room was not moved. NOLINTNEXTLINE(bugprone-use-after-move)
    return chore(
        fail(ErrorCode::kBusy, std::to_string(kMaxChores) + " such requests are waiting already: try again later"));
  }
  if (chores_thread_.get_stop_token().stop_requested()) refuse_chores();  // its thread may already have ended
}

void Scanner::pattern(Answer<std::string> answer) {
  submit_chore([this, answer = std::move(answer)](const Result<>& permission) {
    if (!permission) return answer(tl::unexpected(permission.error()));
    answer(encode_png(setup()->image));
  });
}

// Either all cameras take their new settings, or each keeps its old ones.
Result<> Scanner::set_exposures(const std::vector<CameraOptions>& running, const std::vector<CameraOptions>& wanted,
                                std::chrono::milliseconds time) {
  const auto exchange = [&](std::size_t i, const CameraOptions& to, const CameraOptions& from) -> Result<> {
    auto camera = make_camera(to), otherwise = make_camera(from);
    if (!camera || !otherwise) return tl::unexpected((camera ? otherwise : camera).error());
    chore_heartbeat_.promise(time + kWorkPromise);
    return rig_->replace(i, std::move(*camera), std::move(*otherwise), steady_clock::now() + time);
  };
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (wanted[i] == running[i]) continue;
    auto taken = exchange(i, wanted[i], running[i]);
    if (taken) continue;
    for (std::size_t back = 0; back < i; ++back) {
      if (!(wanted[back] == running[back])) (void)exchange(back, running[back], running[back]);
    }
    return taken;
  }
  return {};
}

void Scanner::reload(const std::filesystem::path& file, const Configuration& running, nlohmann::json settings,
                     Answer<Configuration> answer) {
  submit_chore(
      [this, file, running, settings = std::move(settings), answer = std::move(answer)](const Result<>& permission) {
        if (!permission) return answer(tl::unexpected(permission.error()));
        auto configuration = load_configuration_with(file, settings);
        if (!configuration) return answer(configuration);
        Configuration with_devices = *configuration;
        with_devices.projector = running.projector;
        with_devices.pattern.projector_width_px = running.projector.width_px;
        with_devices.pattern.projector_height_px = running.projector.height_px;
        with_devices.cameras = running.cameras;
        auto made = ScanSetup::create(with_devices, DecodeLanes::lanes_here(), setup().get());
        if (!made) return answer(tl::unexpected(made.error()));
        auto replacement = std::make_shared<ScanSetup>(std::move(*made));
        auto taken = set_exposures(running.cameras, with_exposures_of(running.cameras, configuration->cameras),
                                   running.scan.camera_settings_time());
        if (!taken) return answer(tl::unexpected(taken.error()));
        {
          const std::lock_guard lock(mutex_);
          setup_.swap(replacement);
        }
        queue_.wake();
        answer(configuration);
      });
}

void Scanner::last_scans(Answer<std::vector<KeptScan>> answer) {
  submit_chore([this, answer = std::move(answer)](const Result<>& permission) {
    if (!permission) return answer(tl::unexpected(permission.error()));
    answer(black_box_.scans());
  });
}

void Scanner::run_freely(std::optional<FreeRun> demand) {
  if (demand) free_formats_ = demand->formats;
  free_rate_hz_ = demand ? demand->rate_hz : 0;
  if (!demand) setup()->dense->end_stream();
  queue_.wake();
}

// --- outcomes ---

void Scanner::conclude(const Scan& scan, Result<ScanResult>& result) {
  const std::lock_guard lock(concluding_);
  const LogField about("SLSD_SCAN", scan.id());
  const std::uint64_t skipped = lanes_.skipped();
  const std::uint64_t skipped_now = skipped - std::exchange(skipped_reported_, skipped);
  if (result) result->skipped = skipped_now;
  statistics_.note(result, skipped_now);
  if (result) watch_.note(scan.setup(), *result, scan.number());
  if (black_box_.bytes_max() > 0 && (result || result.error().code != ErrorCode::kCancelled))
    black_box_.keep_outcome(scan.id(), result ? scan.setup() : setup(), result);
  log_outcome(scan.id(), result);
  if (!result && failure_listener_) failure_listener_(scan.id(), result.error());
}

void Scanner::log_outcome(const std::string& scan_id, const Result<ScanResult>& result) {
  if (result) {
    spdlog::debug("scan {}: {} points, capture {:.1f} ms, decode {:.1f} ms, {} lost tries", scan_id,
                  result->cloud.points.size(), in_ms(result->capture_time), in_ms(result->decode_time),
                  result->lost.count);
    if (result->empty.empty()) {
      empty_reported_ = false;
    } else if (!empty_reported_.exchange(true)) {
      spdlog::warn("scan {}: no points: {}", scan_id, result->empty);
    }
    if (failures_in_a_row_.exchange(0) == 0) return;
    const MessageId id(MessageId::kScansSucceedAgain);
    return spdlog::info("scan {}: scans succeed again", scan_id);
  }
  const bool of_the_client = result.error().code == ErrorCode::kCancelled;
  const auto level = of_the_client || failures_in_a_row_ > 0 ? spdlog::level::debug : spdlog::level::info;
  const LogField code("SLSD_ERROR", std::string(to_string(result.error().code)));
  const MessageId id(MessageId::kScanFailed);
  spdlog::log(level, "scan {} failed ({}): {}", scan_id, to_string(result.error().code), to_string(result.error()));
  if (!of_the_client) ++failures_in_a_row_;
}

}  // namespace slsd
