// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/slsctl/progress.hpp"

#include <unistd.h>

#include <chrono>
#include <iostream>
#include <utility>

#include <fmt/format.h>

namespace slsd {
namespace {

constexpr std::chrono::seconds kSoon{1};  // shorter requests need no progress

}  // namespace

Progress::Progress(const ClientOptions& options, Connection& connection, std::string doing)
    : connection_(connection), doing_(std::move(doing)) {
  if (options.json || ::isatty(STDERR_FILENO) == 0) return;
  connection_.set_waiting([this](std::chrono::steady_clock::duration waited) {
    if (waited < kSoon) return;
    const auto text = fmt::format("{}, {:.0f} s", doing_, std::chrono::duration<double>(waited).count());
    shown_ = text.size();
    std::cerr << "\r" << text << std::flush;
  });
}

Progress::~Progress() {
  connection_.set_waiting({});
  if (shown_ > 0) std::cerr << "\r" << std::string(shown_, ' ') << "\r" << std::flush;
}

}  // namespace slsd
