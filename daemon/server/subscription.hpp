// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <utility>

#include "daemon/scan/cloud/cloud_files.hpp"
#include "daemon/scan/scanner.hpp"
#include "daemon/server/reply.hpp"

namespace slsd {

/// A free scan on its way to the subscribers. Each wanted format is written once, usually on the thread that decoded
/// it.
/// @thread thread-bound
class Publication {
 public:
  explicit Publication(FreeScan scan) : scan_(std::move(scan)) {
    if (*scan_) files_ = (*scan_)->files;
  }

  [[nodiscard]] const Result<ScanResult>& scan() const { return *scan_; }
  [[nodiscard]] SharedBytes cloud(CloudForm form) { return files_.file((*scan_)->cloud, (*scan_)->dense.get(), form); }
  /// A memfd for one client. @errors kNoSpace; kIo
  [[nodiscard]] Result<SealedMemory> memory(CloudForm form) {
    return files_.memory((*scan_)->cloud, (*scan_)->dense.get(), form);
  }
  /// The transform of a form's points; null: they are in the rig's frame.
  [[nodiscard]] const RigidTransform* base_from_rig(CloudForm form) const { return files_.base_from_rig(form); }
  /// Tells whether the cloud has that density. A scan taken before anybody asked for a point for each pixel has none.
  [[nodiscard]] bool fits(CloudForm form) const { return !*scan_ || !form.dense() || (*scan_)->dense; }
  /// The memory of the cloud and its files so far, in bytes.
  [[nodiscard]] std::size_t bytes() const {
    if (!*scan_) return 0;
    return (*scan_)->cloud.points.size() * sizeof(CloudPoint) + files_.bytes() +
           ((*scan_)->dense ? (*scan_)->dense->bytes() : 0);
  }

 private:
  FreeScan scan_;
  CloudFiles files_;
};

using SharedPublication = std::shared_ptr<Publication>;  // shared: clients send it at their own pace

/// One client's subscription to the free scans. Clouds that cannot be sent yet wait for a turn, so that clouds that
/// arrive together are all sent. The newest wins: if too many wait, or one waits too long, the oldest are lost and
/// counted.
/// @thread thread-bound
class Subscription {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kWaitingMax = 4;
  static constexpr std::chrono::milliseconds kTurn{100};  ///< time after which a newer cloud replaces a waiting one

  /// @param as_memfd  each cloud comes as a sealed memfd, not inline
  Subscription(CloudForm form, std::optional<double> rate_hz, bool as_memfd = false)
      : form_(form), rate_hz_(rate_hz), as_memfd_(as_memfd) {}

  [[nodiscard]] std::optional<double> rate_hz() const { return rate_hz_; }
  [[nodiscard]] CloudForm form() const { return form_; }
  [[nodiscard]] bool as_memfd() const { return as_memfd_; }

  /// Accepts a scan, unless it comes sooner than the client's rate allows.
  void offer(SharedPublication publication, Clock::time_point now);
  /// Counts clouds that were replaced before this client's session saw them.
  void note_lost(std::uint64_t count) {
    if (!rate_hz_) lost_ += count, uncounted_ += count;  // with a rate, the next cloud is as good
  }
  /// The clouds lost since the last call.
  [[nodiscard]] std::uint64_t take_uncounted() { return std::exchange(uncounted_, 0); }
  /// The memory that the waiting clouds hold, in bytes.
  [[nodiscard]] std::size_t waiting_bytes() const;
  /// Drops the cloud that has waited longest.
  void lose_oldest();
  /// The event to send next, with the number of clouds lost since the previous event; nothing if none waits.
  [[nodiscard]] std::optional<Outgoing> take(Clock::time_point now);

 private:
  struct Waiting {
    SharedPublication publication;
    Clock::time_point since;
  };
  void drop_old(Clock::time_point now);

  CloudForm form_;
  std::optional<double> rate_hz_;
  bool as_memfd_;
  Clock::time_point next_{};
  std::deque<Waiting> waiting_;
  std::uint64_t lost_ = 0;
  std::uint64_t uncounted_ = 0;
};

}  // namespace slsd
