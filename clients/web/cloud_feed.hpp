// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include <nlohmann/json.hpp>

#include "clients/slsctl/report.hpp"
#include "core/result.hpp"

namespace slsd::web {

/// A cloud from the service: its file, and its description.
struct WatchedCloud {
  std::uint64_t number = 0;
  nlohmann::json about;
  client::Bytes file;
};
using SharedCloud = std::shared_ptr<const WatchedCloud>;  // shared: watchers send it at their own pace

/// The newest cloud of one kind for any number of watchers, from one subscription while somebody watches.
/// @thread thread-safe
class CloudFeed {
 public:
  /// The density and format of the clouds, and how many come in a second at most.
  struct Kind {
    std::string density, format;
    double rate_hz;
  };

  CloudFeed(std::filesystem::path socket, Kind kind);
  CloudFeed(const CloudFeed&) = delete;
  CloudFeed& operator=(const CloudFeed&) = delete;

  /// Waits for a cloud after that number, or for a failure. @return null if neither came in time
  [[nodiscard]] tl::expected<SharedCloud, Failure> next(std::uint64_t after, std::chrono::milliseconds time);

 private:
  void run(const std::stop_token& stop);
  [[nodiscard]] std::optional<Failure> follow(const std::stop_token& stop);
  [[nodiscard]] bool wanted() const;

  std::filesystem::path socket_;
  Kind kind_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::chrono::steady_clock::time_point wanted_until_{};
  SharedCloud newest_;
  std::optional<Failure> failure_;
  std::uint64_t failures_ = 0;
  std::uint64_t clouds_ = 0;
  std::jthread thread_;
};

}  // namespace slsd::web
