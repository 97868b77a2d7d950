// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <thread>
#include <vector>

#include "core/executor.hpp"

namespace slsd::test {

/// Threads that share the parts in turn, whichever is quicker.
class Threads final : public Executor {
 public:
  explicit Threads(int workers) : workers_(workers) {}
  [[nodiscard]] int workers() const override { return workers_; }

 protected:
  void run_parts(int parts, Part part, const void* work) override {
    const auto run = [&](int worker) {
      for (int i = worker; i < parts; i += workers_) part(work, i, worker);
    };
    std::vector<std::jthread> others;
    for (int worker = 1; worker < workers_; ++worker) others.emplace_back(run, worker);
    run(0);
  }

 private:
  int workers_;
};

}  // namespace slsd::test
