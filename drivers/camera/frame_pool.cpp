// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/frame_pool.hpp"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <utility>
#include <variant>

namespace slsd {

struct FramePool::Buffers final : LentBuffers {
  Buffers(FrameFormat of, int count)
      : LentBuffers(static_cast<std::size_t>(count)),
        format(of),
        words_each((static_cast<std::size_t>(of.width_px) * of.height_px * of.bytes_per_pixel + 1) / 2),
        memory(std::make_unique_for_overwrite<std::uint16_t[]>(words_each * size())) {}

  FrameFormat format;
  std::size_t words_each;
  std::unique_ptr<std::uint16_t[]> memory;  // unwritten pages use no memory, so only lent buffers are resident
};

namespace {

template <class T>
GreyView copy_pixels(const ImageView<T>& from, void* memory) {
  T* to = static_cast<T*>(memory);
  for (int y = 0; y < from.height; ++y)
    std::copy_n(from.row(y), from.width, to + static_cast<std::ptrdiff_t>(y) * from.width);
  return ImageView<T>{to, from.width, from.height, from.width};
}

}  // namespace

FrameFormat format_of(const GreyView& image) {
  return std::visit(
      [](const auto& view) {
        return FrameFormat{view.width, view.height, static_cast<int>(sizeof(*view.pixels))};
      },
      image);
}

FramePool::FramePool(FrameFormat format, int buffers) : buffers_(std::make_shared<Buffers>(format, buffers)) {}

const FrameFormat& FramePool::format() const {
  return buffers_->format;
}

bool FramePool::all_lent() const {
  return !buffers_->find_free();
}

std::optional<Frame> FramePool::lend(const GreyView& image, std::uint64_t sequence, MonotonicTime exposure_start) {
  assert(format_of(image) == buffers_->format);
  const auto buffer = buffers_->find_free();
  if (!buffer) return std::nullopt;
  void* memory = buffers_->memory.get() + *buffer * buffers_->words_each;
  const GreyView pixels = std::visit([&](const auto& view) { return copy_pixels(view, memory); }, image);
  return std::make_optional<Frame>(pixels, sequence, exposure_start, std::chrono::steady_clock::now(),
                                   buffers_->lend(*buffer));
}

}  // namespace slsd
