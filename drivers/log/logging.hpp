// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <spdlog/common.h>
#include <spdlog/sinks/sink.h>

namespace slsd {

/// The longest line of the log, with its end. Longer lines end in an ellipsis.
inline constexpr std::size_t kLogLineBytesMax = 2048;
/// The longest wait for the log's reader at the end of the program.
inline constexpr std::chrono::milliseconds kLogTimeout{300};
/// The same after a failure: the last line gives its reason, and a busy machine may need a while to write it.
inline constexpr std::chrono::milliseconds kFailureLogTimeout{5000};
/// The greatest number of lines that wait for the log's reader. Later lines are dropped and counted, until half of them
/// are read.
inline constexpr std::size_t kLogLinesMax = 1024;

/// Writes each log line so that its text cannot imitate another line: printable, and at most kLogLineBytesMax. Writes
/// at once, or, after queue_lines(), through a bounded queue and a thread of its own. Then a slow reader delays nobody
/// who logs. spdlog's own queue holds lines before they are cut, and its thread cannot be abandoned: at exit it would
/// wait for a stalled reader.
/// @thread thread-safe
class LogSink final : public spdlog::sinks::sink {
 public:
  /// One line as it is written.
  struct Line {
    spdlog::level::level_enum level;
    std::string text;
    std::vector<std::string> fields;  ///< "SLSD_CAMERA=left": each LogField of the thread that logged it
  };
  /// The prefix and the destination of a line.
  struct Output {
    std::function<std::string(const spdlog::details::log_msg&)> prefix;
    std::function<void(const Line&)> write;  ///< may wait for the reader
  };
  explicit LogSink(Output output);
  ~LogSink() override;

  void log(const spdlog::details::log_msg& message) override;
  void flush() override {}
  void set_pattern(const std::string&) override {}
  void set_formatter(std::unique_ptr<spdlog::formatter>) override {}

  /// Queues every line from now on.
  /// @param id_of_dropped  MESSAGE_ID of the line that counts dropped lines
  void queue_lines(std::string_view id_of_dropped);
  /// Waits until all earlier lines are written, at most this long. @return whether they are
  [[nodiscard]] bool wait_written(std::chrono::milliseconds timeout) const;
  [[nodiscard]] std::uint64_t dropped() const;

 private:
  struct Queue;
  Output output_;
  std::shared_ptr<Queue> queue_;  // shared with the thread, which may outlive this object in an endless write
};

/// Sends the log to the journal if systemd reads standard error, with each line's priority. Otherwise sends it to
/// standard error, with time and level. Writes at once, so that a command's log and output keep their order.
void start_logging(spdlog::level::level_enum level);
/// Queues the log's lines from now on, so that no line delays any thread. For the service.
/// @param id_of_dropped  as for LogSink::queue_lines()
void queue_log(std::string_view id_of_dropped);
/// Gives the log's reader this long to read the rest before the program ends.
void flush_log(std::chrono::milliseconds timeout);
/// Lines dropped since queue_log() because the reader was too slow.
[[nodiscard]] std::uint64_t log_lines_dropped();

}  // namespace slsd
