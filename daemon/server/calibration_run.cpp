// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/calibration_run.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <system_error>
#include <utility>

#include <spdlog/spdlog.h>

#include "core/printable.hpp"
#include "drivers/system/file_descriptor.hpp"

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

/// What slsd-calibrate begins with: no descriptor but its output, no signal ignored or held back.
class SpawnSetting {
 public:
  explicit SpawnSetting(int output) {
    ::posix_spawn_file_actions_init(&actions_);
    ::posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    ::posix_spawn_file_actions_adddup2(&actions_, output, STDOUT_FILENO);
    ::posix_spawn_file_actions_adddup2(&actions_, output, STDERR_FILENO);
    ::posix_spawn_file_actions_addclosefrom_np(&actions_, STDERR_FILENO + 1);
    ::posix_spawnattr_init(&attributes_);
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    ::posix_spawnattr_setsigmask(&attributes_, &none);
    ::posix_spawnattr_setsigdefault(&attributes_, &all);
    ::posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  }
  ~SpawnSetting() {
    ::posix_spawn_file_actions_destroy(&actions_);
    ::posix_spawnattr_destroy(&attributes_);
  }
  SpawnSetting(const SpawnSetting&) = delete;
  SpawnSetting& operator=(const SpawnSetting&) = delete;

  int spawn(pid_t& process, const std::filesystem::path& program, const std::vector<std::string>& arguments) {
    std::string name = program.string();
    std::vector<char*> pointers{name.data()};
    for (const std::string& argument : arguments) pointers.push_back(const_cast<char*>(argument.c_str()));
    pointers.push_back(nullptr);
    return ::posix_spawn(&process, program.c_str(), &actions_, &attributes_, pointers.data(), environ);
  }

 private:
  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

}  // namespace

CalibrationRun::CalibrationRun(asio::io_context& events, std::function<void(bool made)> ended)
    : ended_(std::move(ended)), output_(events), exit_(events), watch_(events) {}

CalibrationRun::~CalibrationRun() {
  if (process_ == 0) return;
  ::kill(process_, SIGKILL);
  ::waitpid(process_, nullptr, 0);
}

Result<> CalibrationRun::begin(const std::filesystem::path& program, const std::vector<std::string>& arguments) {
  if (under_way()) return fail(ErrorCode::kBusy, "a calibration is under way: end or cancel that one first");
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return fail(ErrorCode::kIo, "no pipe: " + std::generic_category().message(errno));
  const FileDescriptor writing(ends[1]);
  std::error_code ignored;
  output_.close(ignored);
  output_.assign(ends[0]);
  if (const int error = SpawnSetting(writing.number()).spawn(process_, program, arguments); error != 0) {
    process_ = 0;
    const bool missing = error == ENOENT || error == ENOTDIR;
    return fail(missing ? ErrorCode::kNotFound : ErrorCode::kIo,
                missing ? "what calibrates is not installed: install the package slsd-calibrate"
                        : "does not start: " + std::generic_category().message(error),
                program.string());
  }
  phase_ = Phase::kUnderWay;
  cancelled_ = false;
  progress_ = {{"state", "starting"}};
  outcome_ = error_ = nullptr;
  log_.clear();
  line_.clear();
  ++number_;
  looked_ = Clock::now();
  spdlog::info("a calibration begins (process {})", process_);
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

// Its output has ended, and so has it, or is about to.
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
  if (error_.is_null()) error_ = cancelled_ ? "it was cancelled" : "what calibrates ended early: look at the log";
  conclude({});
  ended_(false);
}

void CalibrationRun::conclude(const Result<>& in_force) {
  phase_ = Phase::kNone;
  ++number_;
  if (!in_force) error_ = printable(to_string(in_force.error()), 1000);
  progress_["state"] = error_.is_null() ? "in force" : "ended";
  watch_.cancel();
  spdlog::info("a calibration ended: {}", error_.is_null() ? "it is in force" : error_.get<std::string>());
}

void CalibrationRun::watch() {
  watch_.expires_after(kWatchPeriod);
  watch_.async_wait([this](const std::error_code& error) {
    if (error || !under_way()) return;
    if (Clock::now() - looked_ > kUnwatched && process_ != 0 && !cancelled_) {
      error_ = "nobody looked at it for two minutes: it was given up";
      cancel();
    }
    watch();
  });
}

}  // namespace slsd
