// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>

#include "core/result.hpp"
#include "tests/doubles/v4l2/double_device.hpp"
#include "tests/doubles/v4l2/double_options.hpp"
#include "tests/doubles/v4l2/fuse_file.hpp"

namespace slsd::test {

/// A camera of V4L2 without a kernel driver: a file that takes V4L2's ioctls, poll and mmap from any process, and plays
/// faults when told. Between unplug() and replug() there is no file; replugged it has forgotten its settings.
/// @thread thread-safe
class V4l2Double {
 public:
  /// @errors kUnsupported: this machine, or this user, cannot mount FUSE
  [[nodiscard]] static Result<std::unique_ptr<V4l2Double>> create(DoubleOptions options);
  ~V4l2Double();
  V4l2Double(const V4l2Double&) = delete;
  V4l2Double& operator=(const V4l2Double&) = delete;

  /// Of the device.
  [[nodiscard]] std::filesystem::path path() const { return folder_ / "video0"; }

  void unplug();
  void replug();
  /// One frame of a triggered double.
  void trigger() { device()->trigger(); }
  void inject(const std::function<void(DoubleFaults&)>& change) { device()->inject(change); }
  void stall(std::chrono::nanoseconds duration);
  /// Also for the lives to come.
  void configure(const std::function<void(DoubleOptions&)>& change);

  /// The number of the next frame whose exposure begins, over all lives.
  [[nodiscard]] std::uint64_t next_number() const { return numbers_; }
  /// How often anyone asked for a frame: a capture() that waits has.
  [[nodiscard]] std::uint64_t polls() const { return file_->polls(); }
  [[nodiscard]] bool is_streaming() const { return device()->is_streaming(); }
  [[nodiscard]] std::optional<int> control(std::uint32_t id) const { return device()->control(id); }

 private:
  explicit V4l2Double(DoubleOptions options) : options_(std::move(options)) {}
  [[nodiscard]] std::shared_ptr<DoubleDevice> device() const;

  mutable std::mutex mutex_;
  DoubleOptions options_;
  std::filesystem::path folder_;
  std::atomic<std::uint64_t> numbers_{0};
  std::unique_ptr<FuseFile> file_;
  std::shared_ptr<DoubleDevice> device_;
};

}  // namespace slsd::test
