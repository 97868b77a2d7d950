// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <variant>
#include <vector>

namespace slsd {

/// A borrowed rectangle of pixels, row by row. Pixel centres have integer coordinates, (0, 0) is the first, x right, y
/// down.
/// @thread reentrant
template <class T>
struct ImageView {
  const T* pixels = nullptr;
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;  ///< distance from one row to the next, in pixels

  [[nodiscard]] const T* row(int y) const { return pixels + y * stride; }
  [[nodiscard]] const T& at(int x, int y) const { return row(y)[x]; }
  [[nodiscard]] bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }
};

/// The interpolated level between four pixels, all within the image: at x + right and y + down, each of 0 to 1.
template <class T>
[[nodiscard]] double level_between(const ImageView<T>& image, int x, int y, double right, double down) {
  return (image.at(x, y) * (1 - right) + image.at(x + 1, y) * right) * (1 - down) +
         (image.at(x, y + 1) * (1 - right) + image.at(x + 1, y + 1) * right) * down;
}

/// An owned image without padding.
/// @thread reentrant
template <class T>
class Image {
 public:
  Image() = default;
  Image(int width, int height, T value = T{})
      : width_(width), height_(height), pixels_(static_cast<std::size_t>(width) * height, value) {}

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] bool empty() const { return pixels_.empty(); }
  [[nodiscard]] T* row(int y) { return pixels_.data() + static_cast<std::ptrdiff_t>(y) * width_; }
  [[nodiscard]] const T* row(int y) const { return pixels_.data() + static_cast<std::ptrdiff_t>(y) * width_; }
  [[nodiscard]] T& at(int x, int y) { return row(y)[x]; }
  [[nodiscard]] const T& at(int x, int y) const { return row(y)[x]; }
  [[nodiscard]] T* data() { return pixels_.data(); }
  [[nodiscard]] const T* data() const { return pixels_.data(); }
  [[nodiscard]] std::size_t size() const { return pixels_.size(); }
  [[nodiscard]] ImageView<T> view() const { return {pixels_.data(), width_, height_, width_}; }
  friend bool operator==(const Image&, const Image&) = default;

 private:
  int width_ = 0;
  int height_ = 0;
  std::vector<T> pixels_;
};

using Grey8 = Image<std::uint8_t>;
using Grey16 = Image<std::uint16_t>;
using Rgb = std::array<std::uint8_t, 3>;
using ColourImage = Image<Rgb>;

/// The grey image that the decoder reads: 8 or 16 bits a pixel, borrowed.
using GreyView = std::variant<ImageView<std::uint8_t>, ImageView<std::uint16_t>>;

/// Width and height.
[[nodiscard]] inline std::pair<int, int> size_of(const GreyView& image) {
  return std::visit([](const auto& view) { return std::pair(view.width, view.height); }, image);
}

}  // namespace slsd
