// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/log/logging.hpp"

#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>

#include "drivers/log/log_field.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;

constexpr auto kTimeout = 120s;

/// Reads the log, or stands still.
class Reader {
 public:
  [[nodiscard]] LogSink::Output output() {
    return {[](const auto&) { return std::string("> "); }, [this](const LogSink::Line& line) { take(line); }};
  }
  void set_reading(bool reading) {
    const std::lock_guard lock(mutex_);
    reading_ = reading;
    changed_.notify_all();
  }
  [[nodiscard]] std::vector<std::string> lines() {
    const std::lock_guard lock(mutex_);
    return lines_;
  }
  /// Of the line that came last.
  [[nodiscard]] std::vector<std::string> fields() {
    const std::lock_guard lock(mutex_);
    return fields_.back();
  }

 private:
  void take(const LogSink::Line& line) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return reading_; });
    lines_.push_back(line.text);
    fields_.push_back(line.fields);
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool reading_ = true;
  std::vector<std::string> lines_;
  std::vector<std::vector<std::string>> fields_;
};

void log_line(LogSink& sink, const std::string& text) {
  sink.log({"slsd", spdlog::level::info, text});
}

TEST(LogSink, WritesAtOnceUnlessToldToQueue) {
  Reader reader;
  LogSink sink(reader.output());
  log_line(sink, "one");
  EXPECT_THAT(reader.lines(), ElementsAre("> one"));
}

TEST(LogSink, LetsNoTextPassForALineOfItsOwn) {
  Reader reader;
  LogSink sink(reader.output());
  log_line(sink, "camera x\n<2>kernel panic\x1b[31m");
  EXPECT_THAT(reader.lines(), ElementsAre(R"(> camera x\n<2>kernel panic\x1b[31m)"));
}

TEST(LogSink, CutsLongLines) {
  Reader reader;
  LogSink sink(reader.output());
  log_line(sink, std::string(900'000, 'x'));
  log_line(sink, std::string(900'000, '\n'));
  for (const std::string& line : reader.lines()) EXPECT_LT(line.size(), kLogLineBytesMax);
}

TEST(LogSink, TellsWhatTheThreadsLinesAreAbout) {
  Reader reader;
  LogSink sink(reader.output());
  {
    const LogField camera("SLSD_CAMERA", "left\nPRIORITY=2");
    {
      const LogField error("SLSD_ERROR", std::string(900'000, 'x'));
      log_line(sink, "one");
      EXPECT_THAT(reader.fields(), ElementsAre(StartsWith("SLSD_ERROR=x"), R"(SLSD_CAMERA=left\nPRIORITY=2)"));
      EXPECT_LT(reader.fields().front().size(), 300U);
    }
    log_line(sink, "two");
    EXPECT_THAT(reader.fields(), SizeIs(1));
    std::jthread([&] { log_line(sink, "three"); }).join();
    EXPECT_THAT(reader.fields(), IsEmpty());
  }
  log_line(sink, "four");
  EXPECT_THAT(reader.fields(), IsEmpty());
}

TEST(LogSink, HoldsNobodyUpAndTellsOnceWhatWasDropped) {
  Reader reader;
  LogSink sink(reader.output());
  sink.queue_lines("42");
  reader.set_reading(false);
  constexpr std::size_t kLogged = 5 * kLogLinesMax;
  for (std::size_t i = 0; i < kLogged; ++i) log_line(sink, std::to_string(i));
  EXPECT_FALSE(sink.wait_written(10ms));
  const std::uint64_t dropped = sink.dropped();
  EXPECT_GE(dropped, kLogged - kLogLinesMax - 1);
  reader.set_reading(true);
  ASSERT_TRUE(sink.wait_written(kTimeout));
  EXPECT_EQ(sink.dropped(), dropped);
  const auto lines = reader.lines();
  ASSERT_THAT(lines, SizeIs(kLogged - dropped + 1));
  for (std::size_t i = 0; i + 1 < lines.size(); ++i) EXPECT_EQ(lines[i], "> " + std::to_string(i));
  EXPECT_THAT(lines.back(), HasSubstr(std::to_string(dropped) + " lines of the log were dropped here"));
  EXPECT_THAT(reader.fields(), ElementsAre("MESSAGE_ID=42"));
  log_line(sink, "flows again");
  ASSERT_TRUE(sink.wait_written(kTimeout));
  EXPECT_EQ(reader.lines().back(), "> flows again");
}

}  // namespace
}  // namespace slsd
