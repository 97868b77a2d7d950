// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/web/cloud_feed.hpp"

#include <utility>

#include "clients/connection/connection.hpp"

namespace slsd::web {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kStaysWanted = 5s;  // after the last watcher's request
constexpr auto kTimeout = 90s;     // a busy machine takes long for a cloud of pixels
constexpr auto kPause = 500ms;     // after a failure

}  // namespace

CloudFeed::CloudFeed(std::filesystem::path socket, Kind kind) : socket_(std::move(socket)), kind_(std::move(kind)) {
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

bool CloudFeed::wanted() const {
  return Clock::now() < wanted_until_;
}

tl::expected<SharedCloud, Failure> CloudFeed::next(std::uint64_t after, std::chrono::milliseconds time) {
  std::unique_lock lock(mutex_);
  wanted_until_ = Clock::now() + time + kStaysWanted;
  changed_.notify_all();
  const std::uint64_t failures = failures_;
  const auto there = [&] { return (newest_ && newest_->number != after) || failures_ != failures; };
  if (!changed_.wait_for(lock, time, there)) return nullptr;
  if (newest_ && newest_->number != after) return newest_;
  return tl::unexpected(*failure_);
}

void CloudFeed::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    {
      std::unique_lock lock(mutex_);
      newest_.reset();  // it would be old by the next request
      if (!changed_.wait(lock, stop, [this] { return wanted(); })) return;
    }
    std::optional<Failure> failed = follow(stop);
    std::unique_lock lock(mutex_);
    if (!failed || !wanted()) continue;
    failure_ = std::move(failed);
    ++failures_;
    changed_.notify_all();
    changed_.wait_for(lock, stop, kPause, [] { return false; });
  }
}

// Receives until an error occurs, or nobody wants the clouds any more.
std::optional<Failure> CloudFeed::follow(const std::stop_token& stop) {
  auto connection = Connection::open(socket_);
  if (!connection) return failure(connection.error());
  connection->set_timeout(kTimeout);
  const auto subscribed = ask(*connection, "subscribe",
                              {{"format", kind_.format},
                               {"density", kind_.density},
                               {"coordinate_frame", "rig"},
                               {"rate_hz", kind_.rate_hz},
                               {"transport", "memfd"}});
  if (!subscribed) return subscribed.error();
  for (;;) {
    auto event = connection->receive();
    if (!event) return failure(event.error());
    const std::lock_guard lock(mutex_);
    if (stop.stop_requested() || !wanted()) return std::nullopt;
    nlohmann::json params = event->message.value("params", nlohmann::json::object());
    if (event->message.value("method", "") == "cloud" && params.contains("memfd_bytes")) {
      newest_ =
          std::make_shared<const WatchedCloud>(WatchedCloud{++clouds_, std::move(params), std::move(event->bytes)});
    } else if (params.contains("error")) {
      failure_ = judge(Answered{{{{"error", params["error"]}}, {}}, {}}).error();
      ++failures_;
    }
    changed_.notify_all();
  }
}

}  // namespace slsd::web
