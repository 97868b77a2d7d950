// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/gige/frames/counter_frame.hpp"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <variant>

namespace slsd::test {
namespace {

constexpr int kCounterPixels = 4;

std::uint32_t ramp(std::uint32_t x, std::uint32_t y, std::uint32_t counter, std::uint32_t mask) {
  return (x + 3 * y + 29 * counter) & mask;
}

std::uint32_t counter_byte(std::uint32_t counter, int pixel) {
  return counter >> (8 * pixel) & 0xff;
}

template <class T>
void fill(const ExposureRequest& request, std::vector<std::uint8_t>& pixels) {
  const std::uint32_t mask = (1u << request.bits) - 1;
  pixels.resize(sizeof(T) * static_cast<std::size_t>(request.width_px) * request.height_px);
  T* pixel = reinterpret_cast<T*>(pixels.data());
  for (int y = 0; y < request.height_px; ++y)
    for (int x = 0; x < request.width_px; ++x)
      *pixel++ =
          static_cast<T>(ramp(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), request.counter, mask));
  T* first = reinterpret_cast<T*>(pixels.data());
  for (int i = 0; i < kCounterPixels; ++i) first[i] = static_cast<T>(counter_byte(request.counter, i));
}

template <class T>
std::optional<std::uint32_t> check(const ImageView<T>& image, std::uint32_t mask) {
  std::uint32_t counter = 0;
  for (int i = 0; i < kCounterPixels; ++i) counter |= static_cast<std::uint32_t>(image.at(i, 0) & 0xff) << (8 * i);
  for (int y = 0; y < image.height; ++y) {
    const T* row = image.row(y);
    bool same = true;
    for (int x = y == 0 ? kCounterPixels : 0; x < image.width; ++x)
      same &=
          row[x] == static_cast<T>(ramp(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), counter, mask));
    if (!same) return std::nullopt;
  }
  return counter;
}

}  // namespace

ExposureSource counter_frames() {
  return [](const ExposureRequest& request, std::vector<std::uint8_t>& pixels) {
    if (request.bits > 8)
      fill<std::uint16_t>(request, pixels);
    else
      fill<std::uint8_t>(request, pixels);
  };
}

ExposureSource replayed_images(std::vector<Grey8> images) {
  return [shown = std::make_shared<const std::vector<Grey8>>(std::move(images))](const ExposureRequest& request,
                                                                                 std::vector<std::uint8_t>& pixels) {
    const Grey8& image = (*shown)[request.counter % shown->size()];
    pixels.assign(static_cast<std::size_t>(request.width_px) * request.height_px, 0);
    const int width = std::min(request.width_px, image.width());
    for (int y = 0; y < std::min(request.height_px, image.height()); ++y)
      std::copy_n(image.row(y), width, pixels.data() + static_cast<std::size_t>(y) * request.width_px);
  };
}

std::optional<std::uint32_t> counter_of(const GreyView& image, int bits) {
  return std::visit([mask = (1u << bits) - 1](const auto& view) { return check(view, mask); }, image);
}

}  // namespace slsd::test
