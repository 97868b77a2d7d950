// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "core/result.hpp"
#include "drivers/camera/frame.hpp"
#include "drivers/camera/v4l2/v4l2_device.hpp"

namespace slsd {

/// The driver's buffers, mapped, and lent to frames. What is lent stays mapped until it is given back, also after the
/// device was closed; the rest is unmapped by the destructor.
/// @thread thread-bound; the frames that it lends may end on any thread
class MappedBuffers {
 public:
  /// @param count  how many to ask the driver for, which may give more or fewer
  /// @errors kUnsupported (no memory mapping, or fewer than 3), kBusy, kDisconnected, kIo
  [[nodiscard]] static Result<MappedBuffers> request(const V4l2Device& device, int count);
  MappedBuffers(MappedBuffers&& other) noexcept;
  MappedBuffers& operator=(MappedBuffers&& other) noexcept;
  ~MappedBuffers();

  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] std::span<std::byte> bytes(std::size_t buffer) const;

  /// A lease on a buffer that is not lent.
  [[nodiscard]] Frame lend(std::size_t buffer, const GreyView& image, std::uint64_t sequence,
                           MonotonicTime exposure_start, MonotonicTime received);
  [[nodiscard]] bool is_lent(std::size_t buffer) const;

 private:
  struct Buffers;
  MappedBuffers();
  [[nodiscard]] Result<> map(const V4l2Device& device, std::size_t buffer);

  Buffers* buffers_;  ///< counted by itself, so that a lease fits into std::function without an allocation
};

}  // namespace slsd
