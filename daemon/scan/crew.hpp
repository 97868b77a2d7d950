// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

#include "core/dense/executor.hpp"

namespace slsd {

/// Threads that help the one that calls with the parts of a stage. Whoever comes while they help another does its parts
/// alone, and so does whoever's helpers sleep too long: nobody waits for a thread that has not begun.
/// @thread thread-safe
class Crew final : public Executor {
 public:
  /// @param helpers  threads besides the caller's
  explicit Crew(int helpers);
  ~Crew() override;
  /// As many as leave no processor without one.
  [[nodiscard]] static int helpers_here();

  [[nodiscard]] int workers() const override { return static_cast<int>(threads_.size()) + 1; }

 protected:
  void run_parts(int parts, Part part, const void* work) override;

 private:
  void help(int worker, const std::stop_token& stop);

  std::mutex in_use_;  // by one caller at a time
  std::mutex mutex_;
  std::condition_variable_any changed_;
  Part part_ = nullptr;
  const void* work_ = nullptr;
  int parts_ = 0;  // 0: nothing to help with
  int helping_ = 0;
  std::uint64_t call_ = 0;
  std::atomic<int> next_ = 0;
  std::vector<std::jthread> threads_;
};

}  // namespace slsd
