// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

namespace slsd {

/// Runs the parts of a stage, beside each other or one after the other, and returns when all are done. Core starts no
/// threads: whoever owns some passes them in by this.
class Executor {
 public:
  Executor() = default;
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;
  virtual ~Executor() = default;

  /// How many parts may run beside each other.
  [[nodiscard]] virtual int workers() const = 0;

  /// @param work  called as work(part, worker) for each part from 0 on; no two at once have the same worker
  template <class Work>
  void run(int parts, const Work& work) {
    run_parts(
        parts, [](const void* of, int part, int worker) { (*static_cast<const Work*>(of))(part, worker); }, &work);
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
