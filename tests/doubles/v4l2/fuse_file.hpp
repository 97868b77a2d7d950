// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>

#include "core/result.hpp"
#include "tests/doubles/v4l2/double_device.hpp"

struct fuse_session;

namespace slsd::test {

/// A FUSE mount with one file, "video0", behind which a DoubleDevice answers: ioctls, poll and mmap of a real file.
/// @thread thread-safe
class FuseFile {
 public:
  /// @param folder  an empty folder
  /// @errors kUnsupported: this machine, or this user, cannot mount
  [[nodiscard]] static Result<std::unique_ptr<FuseFile>> mount(const std::string& folder);
  ~FuseFile();
  FuseFile(const FuseFile&) = delete;
  FuseFile& operator=(const FuseFile&) = delete;

  /// How often anyone asked whether there is something to read.
  [[nodiscard]] std::uint64_t polls() const { return polls_; }

  /// What to give a device that plug() will take.
  [[nodiscard]] DoubleDevice::Hooks hooks();

  /// From now on the file is there and opens this device; null takes the file away. Who has it open keeps the device
  /// that it was.
  void plug(std::shared_ptr<DoubleDevice> device);

 private:
  struct Handle;
  struct Operations;
  FuseFile() = default;

  void serve();
  void answer_waiting();
  [[nodiscard]] std::uint64_t inode() const;

  fuse_session* session_ = nullptr;
  int end_ = -1;                        ///< an eventfd that ends serve()
  mutable std::recursive_mutex mutex_;  ///< an interrupted request calls back while it is being registered
  std::shared_ptr<DoubleDevice> device_;
  std::uint64_t lives_ = 1;  ///< each plug gives the file a new inode, as a new device node has
  std::set<Handle*> handles_;
  std::atomic<std::uint64_t> polls_{0};
  std::jthread thread_;
};

}  // namespace slsd::test
