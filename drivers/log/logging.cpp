// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/log/logging.hpp"

#include <poll.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <cerrno>
#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include <spdlog/spdlog.h>
#define SD_JOURNAL_SUPPRESS_LOCATION
#include <systemd/sd-journal.h>

#include "core/printable.hpp"
#include "core/utc_text.hpp"
#include "drivers/log/log_field.hpp"
#include "drivers/system/thread_name.hpp"

namespace slsd {
namespace {

using spdlog::details::log_msg;
using spdlog::level::level_enum;

constexpr const char* kJournalSocket = "/run/systemd/journal/socket";
constexpr std::size_t kFieldBytesMax = 256;

std::shared_ptr<LogSink> log_sink;  // this program's only sink

/// The prefix of a log level for the journal, as in sd-daemon(3).
std::string_view journal_prefix(level_enum level) {
  if (level >= spdlog::level::critical) return "<2>";
  if (level == spdlog::level::err) return "<3>";
  if (level == spdlog::level::warn) return "<4>";
  return level == spdlog::level::info ? "<6>" : "<7>";
}

std::string time_and_level(const log_msg& message) {
  const auto level = spdlog::level::to_string_view(message.level);
  return fmt::format("{} {:<7} ", utc_text_ms(message.time), std::string_view(level.data(), level.size()));
}

/// Tells whether systemd reads standard error. systemd.exec(5) explains JOURNAL_STREAM; it may be inherited from
/// another program.
bool journal_reads_stderr() {
  const char* const stream = std::getenv("JOURNAL_STREAM");
  struct stat status {};
  if (stream == nullptr || ::fstat(STDERR_FILENO, &status) != 0) return false;
  return stream == fmt::format("{}:{}", status.st_dev, status.st_ino);
}

// Without stdio: its lock would be held while the reader stalls, and every other writer would wait too.
void write_stderr(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(STDERR_FILENO, bytes.data(), bytes.size());
    if (written >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno == EAGAIN) {  // another process that shares it made it non-blocking
      pollfd writable{STDERR_FILENO, POLLOUT, 0};
      ::poll(&writable, 1, -1);
    } else if (errno != EINTR) {
      return;
    }
  }
}

LogSink::Output standard_error(std::function<std::string(const log_msg&)> prefix) {
  return {std::move(prefix), [](const LogSink::Line& line) { write_stderr(line.text + "\n"); }};
}

// Writes to the journal directly, because spdlog's journal sink sends no fields except its own.
bool send_to_journal(const LogSink::Line& line) {
  std::vector<std::string> entries{"MESSAGE=" + line.text, fmt::format("PRIORITY={}", journal_prefix(line.level)[1]),
                                   "SYSLOG_IDENTIFIER=slsd"};
  entries.insert(entries.end(), line.fields.begin(), line.fields.end());
  std::vector<iovec> parts;
  for (std::string& entry : entries) parts.push_back({entry.data(), entry.size()});
  return (::sd_journal_sendv)(parts.data(), static_cast<int>(parts.size())) == 0;
}

LogSink::Output journal() {
  return {[](const log_msg&) { return std::string(); },
          [](const LogSink::Line& line) {
            // The journal reads standard error too.
            if (!send_to_journal(line)) write_stderr(fmt::format("{}{}\n", journal_prefix(line.level), line.text));
          }};
}

std::vector<std::string> fields_here() {
  std::vector<std::string> fields;
  for (const LogField* field : LogField::here())
    fields.push_back(fmt::format("{}={}", field->name(), printable(field->value(), kFieldBytesMax)));
  return fields;
}

}  // namespace

struct LogSink::Queue {
  mutable std::mutex mutex;
  mutable std::condition_variable changed;
  std::deque<Line> lines;
  bool queued = false;   // else each logging thread writes its own lines
  bool writing = false;  // a line taken from the queue
  bool dropping = false;
  bool ends = false;
  std::uint64_t dropped = 0;
  std::uint64_t told = 0;  // dropped lines reported so far
  std::string id_of_dropped;

  // Writes one line for all dropped lines, at the place where they are missing.
  void take_up_again() {
    const auto missing = std::exchange(told, dropped);
    dropping = false;
    lines.push_back({spdlog::level::warn,
                     fmt::format("{} lines of the log were dropped here: nothing read them in time", dropped - missing),
                     {"MESSAGE_ID=" + id_of_dropped}});
  }

  void write_lines(const Output& output) {
    std::unique_lock lock(mutex);
    while (true) {
      changed.wait(lock, [&] { return !lines.empty() || ends; });
      if (lines.empty()) return;
      const Line line = std::move(lines.front());
      lines.pop_front();
      if (dropping && lines.size() <= kLogLinesMax / 2) take_up_again();
      writing = true;
      lock.unlock();
      output.write(line);
      lock.lock();
      writing = false;
      changed.notify_all();
    }
  }
};

LogSink::LogSink(Output output) : output_(std::move(output)), queue_(std::make_shared<Queue>()) {}

LogSink::~LogSink() {
  const std::lock_guard lock(queue_->mutex);
  queue_->ends = true;
  queue_->changed.notify_all();
}

void LogSink::log(const log_msg& message) {
  Line line{message.level, output_.prefix(message), fields_here()};
  line.text += printable({message.payload.data(), message.payload.size()}, kLogLineBytesMax - line.text.size() - 1);
  const std::lock_guard lock(queue_->mutex);
  if (!queue_->queued) return output_.write(line);
  if (queue_->lines.size() >= kLogLinesMax) queue_->dropping = true;
  if (queue_->dropping) {
    ++queue_->dropped;
    return;
  }
  queue_->lines.push_back(std::move(line));
  queue_->changed.notify_all();
}

void LogSink::queue_lines(std::string_view id_of_dropped) {
  {
    const std::lock_guard lock(queue_->mutex);
    if (std::exchange(queue_->queued, true)) return;
    queue_->id_of_dropped = id_of_dropped;
  }
  // Leaves the thread alone: a write to a stalled reader can neither be ended nor waited for.
  std::thread([queue = queue_, output = output_] {
    name_this_thread("log");
    queue->write_lines(output);
  }).detach();
}

bool LogSink::wait_written(std::chrono::milliseconds timeout) const {
  std::unique_lock lock(queue_->mutex);
  return queue_->changed.wait_for(lock, timeout, [&] { return queue_->lines.empty() && !queue_->writing; });
}

std::uint64_t LogSink::dropped() const {
  const std::lock_guard lock(queue_->mutex);
  return queue_->dropped;
}

void start_logging(level_enum level) {
  const auto output = [] {
    if (!journal_reads_stderr()) return standard_error(time_and_level);
    if (::access(kJournalSocket, W_OK) == 0) return journal();
    return standard_error([](const log_msg& message) { return std::string(journal_prefix(message.level)); });
  };
  log_sink = std::make_shared<LogSink>(output());
  auto logger = std::make_shared<spdlog::logger>("slsd", log_sink);
  logger->set_level(level);
  spdlog::set_default_logger(std::move(logger));
}

void queue_log(std::string_view id_of_dropped) {
  log_sink->queue_lines(id_of_dropped);
}

void flush_log(std::chrono::milliseconds timeout) {
  static_cast<void>(log_sink->wait_written(timeout));
}

std::uint64_t log_lines_dropped() {
  return log_sink->dropped();
}

}  // namespace slsd
