// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/frame_pool.hpp"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cstddef>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace slsd {

/// The memory, and who holds it: the pool and each frame count once, and the last to go deletes it.
struct FramePool::Buffers {
  Buffers(FrameFormat of, int count)
      : format(of),
        words_each((static_cast<std::size_t>(of.width_px) * of.height_px * of.bytes_per_pixel + 1) / 2),
        memory(words_each * count),
        lent(static_cast<std::size_t>(count)) {}

  void release() {
    if (holders.fetch_sub(1, std::memory_order_acq_rel) == 1) delete this;
  }

  void give_back(std::size_t buffer) {
    lent[buffer].store(false, std::memory_order_release);
    release();
  }

  std::optional<std::size_t> take() {
    for (std::size_t i = 0; i < lent.size(); ++i) {
      if (lent[i].exchange(true, std::memory_order_acquire)) continue;
      holders.fetch_add(1, std::memory_order_relaxed);
      return i;
    }
    return std::nullopt;
  }

  FrameFormat format;
  std::size_t words_each;
  std::vector<std::uint16_t> memory;
  std::vector<std::atomic<bool>> lent;
  std::atomic<int> holders{1};
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

FramePool::FramePool(FrameFormat format, int buffers) : buffers_(new Buffers(format, buffers)) {}

FramePool::FramePool(FramePool&& other) noexcept : buffers_(std::exchange(other.buffers_, nullptr)) {}

FramePool& FramePool::operator=(FramePool&& other) noexcept {
  std::swap(buffers_, other.buffers_);
  return *this;
}

FramePool::~FramePool() {
  if (buffers_ != nullptr) buffers_->release();
}

const FrameFormat& FramePool::format() const {
  return buffers_->format;
}

bool FramePool::all_lent() const {
  return std::ranges::all_of(buffers_->lent, [](const auto& lent) { return lent.load(std::memory_order_acquire); });
}

std::optional<Frame> FramePool::lend(const GreyView& image, std::uint64_t sequence, MonotonicTime exposure_start) {
  assert(format_of(image) == buffers_->format);
  const auto buffer = buffers_->take();
  if (!buffer) return std::nullopt;
  void* memory = buffers_->memory.data() + *buffer * buffers_->words_each;
  const GreyView pixels = std::visit([&](const auto& view) { return copy_pixels(view, memory); }, image);
  return std::make_optional<Frame>(pixels, sequence, exposure_start, std::chrono::steady_clock::now(),
                                   [buffers = buffers_, i = *buffer] { buffers->give_back(i); });
}

}  // namespace slsd
