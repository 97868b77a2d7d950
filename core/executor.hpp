// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <cstddef>

namespace slsd {

/// Runs the parts of a stage, in parallel or one after the other, and returns when all are done. Core starts no
/// threads: the owner of threads passes them in through this interface.
class Executor {
 public:
  Executor() = default;
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;
  virtual ~Executor() = default;

  /// Number of parts that may run at the same time.
  [[nodiscard]] virtual int workers() const = 0;

  /// @param work  called as work(part, worker) for each part from 0 on; no two concurrent calls have the same worker
  template <class Work>
  void run(int parts, const Work& work) {
    run_parts(
        parts, [](const void* of, int part, int worker) { (*static_cast<const Work*>(of))(part, worker); }, &work);
  }

  /// Runs a loop in ranges of equal length, whatever the number of workers. Results that depend on the order within a
  /// range are therefore the same for any number.
  /// @param work  called as work(first, last, worker) for each range, from 0 on; excludes last
  template <class Work>
  void run_ranges(std::size_t count, const Work& work, std::size_t length = 256) {
    run(static_cast<int>((count + length - 1) / length), [&](int part, int worker) {
      const std::size_t first = static_cast<std::size_t>(part) * length;
      work(first, std::min(first + length, count), worker);
    });
  }

 protected:
  using Part = void (*)(const void* work, int part, int worker);
  virtual void run_parts(int parts, Part part, const void* work) = 0;
};

/// One part after the other, on the caller's thread.
class SerialExecutor final : public Executor {
 public:
  [[nodiscard]] int workers() const override { return 1; }

 protected:
  void run_parts(int parts, Part part, const void* work) override {
    for (int i = 0; i < parts; ++i) part(work, i, 0);
  }
};

}  // namespace slsd
