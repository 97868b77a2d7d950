// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "core/result.hpp"

namespace slsd {

/// The text in a driver's field, which may come from the device. Always printable, whatever bytes the device sent, even
/// without a terminator.
[[nodiscard]] std::string device_text(std::span<const unsigned char> field);

/// The link in v4l/by-id to a device node. It stays the same wherever the camera is plugged in.
/// @param node     any of its names
/// @param devices  "/dev"
/// @return nothing if there is no link
/// @thread reentrant
[[nodiscard]] std::optional<std::filesystem::path> find_stable_link(const std::filesystem::path& node,
                                                                    const std::filesystem::path& devices);

/// An open V4L2 device, through libv4l2 with its conversion off.
/// @thread thread-bound
class V4l2Device {
 public:
  /// @param path  a device node; it need not be a character device
  /// @errors kNotFound, kPermissionDenied, kDisconnected, kUnsupported (no capture with streaming), kIo
  [[nodiscard]] static Result<V4l2Device> open(const std::string& path);
  V4l2Device(V4l2Device&& other) noexcept;
  V4l2Device& operator=(V4l2Device&& other) noexcept;
  ~V4l2Device();

  [[nodiscard]] int descriptor() const { return descriptor_; }
  [[nodiscard]] const std::string& path() const { return path_; }
  /// "uvcvideo", ...
  [[nodiscard]] const std::string& driver() const { return driver_; }
  /// The camera's own name for itself.
  [[nodiscard]] const std::string& card() const { return card_; }

  /// Makes the call again if interrupted. Returns 0, or errno.
  [[nodiscard]] int call(unsigned long request, void* argument) const;

  /// The error of a failed call.
  /// @param doing  the failed action, such as "cannot start"
  [[nodiscard]] tl::unexpected<Error> fail_call(int error_number, const std::string& doing) const;

 private:
  V4l2Device(int descriptor, std::string path);

  int descriptor_ = -1;
  std::string path_;
  std::string driver_;
  std::string card_;
};

}  // namespace slsd
