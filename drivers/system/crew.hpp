// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "core/executor.hpp"

namespace slsd {

/// Threads that help a caller to compute the parts of a stage. If they help another caller, or sleep too long, the
/// caller computes its parts alone. So nobody waits for a thread that has not begun.
/// @thread thread-safe
class Crew final : public Executor {
 public:
  /// A caller's turn. While it lives, its thread computes, and the helpers leave a processor to it.
  class Turn {
   public:
    explicit Turn(Crew& crew) : crew_(crew) { ++crew_.turns_; }
    ~Turn() { --crew_.turns_; }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    Crew& crew_;
  };

  /// @param helpers  threads besides the caller's; together they should be one for each processor
  explicit Crew(int helpers);
  ~Crew() override;
  /// The number of helpers that, with the caller, gives every processor a thread.
  [[nodiscard]] static int helpers_here();

  [[nodiscard]] int workers() const override { return static_cast<int>(threads_.size()) + 1; }

 protected:
  void run_parts(int parts, Part part, const void* work) override;

 private:
  void help(int worker, const std::stop_token& stop);
  void take_parts(int worker, Part part, const void* work, int parts);
  /// Tells whether parts remain that no helper has tried, and whether a processor is free for one more helper.
  [[nodiscard]] bool wants(std::uint64_t done) const {
    const std::uint64_t call = on_offer_;
    return call != 0 && call != done && std::max(turns_.load(), 1) + helping_ < workers();
  }

  std::mutex in_use_;  // held by one caller at a time
  std::mutex mutex_;
  std::condition_variable_any changed_;
  Part part_ = nullptr;
  const void* work_ = nullptr;
  int parts_ = 0;
  std::uint64_t call_ = 0;
  // Helpers look at these before they take the mutex.
  std::atomic<std::uint64_t> on_offer_ = 0;  // the call that offers parts; 0: none
  std::atomic<int> helping_ = 0, turns_ = 0;
  std::atomic<int> next_ = 0;
  std::exception_ptr failed_;  // what a part of this call threw
  std::vector<std::jthread> threads_;
};

}  // namespace slsd
