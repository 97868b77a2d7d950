// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/calibration_run.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <system_error>
#include <utility>

#include <spdlog/spdlog.h>

#include "core/printable.hpp"
#include "drivers/system/file_descriptor.hpp"
#include "drivers/system/own_program.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using nlohmann::json;

constexpr auto kUnwatched = 2min;
constexpr auto kWatchPeriod = 1s;
constexpr auto kExitGlance = 20ms;
constexpr std::size_t kLineMax = 256 << 10;
constexpr std::size_t kLogLines = 300;
constexpr std::size_t kLogLineBytes = 500;

}  // namespace

CalibrationRun::CalibrationRun(asio::io_context& events, std::function<void(bool made)> ended)
    : ended_(std::move(ended)), output_(events), exit_(events), watch_(events) {}

CalibrationRun::~CalibrationRun() {
  if (process_ == 0) return;
  ::kill(process_, SIGKILL);
  ::waitpid(process_, nullptr, 0);
}

Result<> CalibrationRun::begin(const std::filesystem::path& program, const std::vector<std::string>& arguments) {
  if (under_way()) return fail(ErrorCode::kBusy, "a calibration is under way: end or cancel it first");
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return fail(ErrorCode::kIo, "no pipe: " + std::generic_category().message(errno));
  const FileDescriptor writing(ends[1]);
  std::error_code ignored;
  output_.close(ignored);
  output_.assign(ends[0]);
  auto started = start_own_program(program, arguments, {-1, writing.number(), writing.number()});
  if (!started) {
    if (started.error().code == ErrorCode::kNotFound)
      started.error().message = "the calibration program is not installed: install the package slsd-calibrate";
    return tl::unexpected(std::move(started.error()));
  }
  process_ = *started;
  phase_ = Phase::kUnderWay;
  cancelled_ = false;
  progress_ = {{"state", "starting"}};
  outcome_ = error_ = nullptr;
  log_.clear();
  line_.clear();
  ++number_;
  looked_ = Clock::now();
  spdlog::info("calibration started (process {})", process_);
  read();
  watch();
  return {};
}

void CalibrationRun::end() {
  if (phase_ == Phase::kUnderWay && process_ != 0) ::kill(process_, SIGINT);
}

void CalibrationRun::cancel() {
  if (phase_ != Phase::kUnderWay || process_ == 0) return;
  cancelled_ = true;
  ::kill(process_, SIGKILL);
}

json CalibrationRun::look() {
  looked_ = Clock::now();
  return {{"under_way", under_way()}, {"number", number_}, {"progress", progress_},
          {"outcome", outcome_},      {"error", error_},   {"log", log_}};
}

void CalibrationRun::read() {
  output_.async_read_some(asio::buffer(chunk_), [this](const std::error_code& error, std::size_t count) {
    if (error == asio::error::operation_aborted) return;
    for (const char letter : std::string_view(chunk_.data(), count)) {
      if (letter != '\n') {
        if (line_.size() < kLineMax) line_ += letter;
        continue;
      }
      take_line(line_);
      line_.clear();
    }
    error ? await_exit() : read();
  });
}

void CalibrationRun::take_line(const std::string& line) {
  ++number_;
  if (line.starts_with('{')) {
    json told = json::parse(line, nullptr, /*allow_exceptions=*/false);
    if (!told.is_object()) return;
    if (told.contains("outcome")) {
      outcome_ = std::move(told["outcome"]);
    } else {
      progress_.update(told);
    }
    return;
  }
  constexpr std::string_view kError = "slsd: ";
  if (line.starts_with(kError)) error_ = printable(line.substr(kError.size()), 1000);
  log_.push_back(printable(line, kLogLineBytes));
  if (log_.size() > kLogLines) log_.pop_front();
}

// The process's output has ended, so it has ended, or will soon.
void CalibrationRun::await_exit() {
  int status = 0;
  if (::waitpid(process_, &status, WNOHANG) == process_) return on_exit(status);
  exit_.expires_after(kExitGlance);
  exit_.async_wait([this](const std::error_code& error) {
    if (!error) await_exit();
  });
}

void CalibrationRun::on_exit(int status) {
  process_ = 0;
  ++number_;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
    phase_ = Phase::kTakingForce;
    return ended_(true);
  }
  if (error_.is_null())
    error_ = cancelled_ ? "the calibration was cancelled" : "the calibration program ended early: see the log";
  conclude({});
  ended_(false);
}

void CalibrationRun::conclude(const Result<>& in_force) {
  phase_ = Phase::kNone;
  ++number_;
  if (!in_force) error_ = printable(to_string(in_force.error()), 1000);
  progress_["state"] = error_.is_null() ? "in force" : "ended";
  watch_.cancel();
  spdlog::info("calibration ended: {}",
               error_.is_null() ? "the new calibration is in force" : error_.get<std::string>());
}

void CalibrationRun::watch() {
  watch_.expires_after(kWatchPeriod);
  watch_.async_wait([this](const std::error_code& error) {
    if (error || !under_way()) return;
    if (Clock::now() - looked_ > kUnwatched && process_ != 0 && !cancelled_) {
      error_ = "cancelled: no client asked for its state for two minutes";
      cancel();
    }
    watch();
  });
}

}  // namespace slsd
