// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/system/crew.hpp"

#include <atomic>
#include <chrono>
#include <new>
#include <set>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace slsd {
namespace {

using namespace std::chrono_literals;

TEST(Crew, DoesEveryPartOnce) {
  Crew crew(3);
  EXPECT_EQ(crew.workers(), 4);
  for (int parts : {0, 1, 2, 5, 1000}) {
    std::vector<std::atomic<int>> done(parts);
    crew.run(parts, [&](int part, int) { ++done[part]; });
    for (const auto& count : done) EXPECT_EQ(count, 1);
  }
}

TEST(Crew, NoTwoAtOnceAreTheSameWorker) {
  Crew crew(3);
  std::vector<std::atomic<int>> busy(4);
  for (int round = 0; round < 200; ++round) {
    crew.run(64, [&](int, int worker) {
      EXPECT_EQ(busy.at(worker)++, 0);
      --busy[worker];
    });
  }
}

TEST(Crew, ThrowsWhatAPartThrowsOnceAllHaveEnded) {
  Crew crew(3);
  for (const int bad : {0, 1, 40, 63}) {
    std::atomic<int> inside = 0;
    const auto work = [&](int part, int) {
      ++inside;
      if (part == bad) {
        --inside;
        throw std::bad_alloc();
      }
      std::this_thread::sleep_for(50us);
      --inside;
    };
    EXPECT_THROW(crew.run(64, work), std::bad_alloc);
    EXPECT_EQ(inside, 0);
    std::atomic<int> done = 0;
    crew.run(64, [&](int, int) { ++done; });
    EXPECT_EQ(done, 64);
  }
}

TEST(Crew, HelpersHelp) {
  Crew crew(1);
  std::mutex mutex;
  std::set<int> workers;
  // Each waits a while for the other, so that both have parts.
  crew.run(2, [&](int, int worker) {
    const auto end = std::chrono::steady_clock::now() + 5s;
    {
      const std::lock_guard lock(mutex);
      workers.insert(worker);
    }
    for (bool both = false; !both && std::chrono::steady_clock::now() < end;) {
      std::this_thread::sleep_for(1ms);
      const std::lock_guard lock(mutex);
      both = workers.size() == 2;
    }
  });
  EXPECT_EQ(workers.size(), 2U);
}

TEST(Crew, WhoeverComesMeanwhileWorksAlone) {
  Crew crew(2);
  std::atomic<int> done = 0;
  std::vector<std::jthread> callers;
  for (int caller = 0; caller < 4; ++caller) {
    callers.emplace_back([&] {
      for (int round = 0; round < 100; ++round) crew.run(16, [&](int, int) { ++done; });
    });
  }
  callers.clear();
  EXPECT_EQ(done, 4 * 100 * 16);
}

TEST(Crew, WithoutHelpersTheCallerDoesAll) {
  Crew crew(0);
  int sum = 0;
  crew.run(10, [&](int part, int worker) { sum += part + worker; });
  EXPECT_EQ(sum, 45);
}

TEST(Crew, HelpersLeaveAProcessorToEachThatComputes) {
  Crew crew(1);
  std::set<int> workers;
  const Crew::Turn one(crew), other(crew);
  for (int round = 0; round < 50; ++round) crew.run(16, [&](int, int worker) { workers.insert(worker); });
  EXPECT_EQ(workers, std::set{0});
}

}  // namespace
}  // namespace slsd
