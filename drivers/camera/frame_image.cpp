// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/frame_image.hpp"

#include <cstring>
#include <utility>
#include <variant>

#include "drivers/files/encode_png.hpp"

namespace slsd {
namespace {

FrameImage described(const Frame& frame, std::string memory = {}) {
  return std::visit(
      [&]<class T>(const ImageView<T>& image) {
        return FrameImage{.bytes = std::move(memory),
                          .width_px = image.width,
                          .height_px = image.height,
                          .bits = static_cast<int>(8 * sizeof(T)),
                          .sequence = frame.sequence(),
                          .exposure_start = frame.exposure_start(),
                          .received = frame.received()};
      },
      frame.image());
}

}  // namespace

Result<FrameImage> png_of(const Frame& frame) {
  auto png = encode_png(frame.image());
  if (!png) return tl::unexpected(png.error());
  FrameImage image = described(frame);
  image.bytes = std::move(*png);
  return image;
}

void copy_raw(const Frame& frame, FrameImage& image) {
  image = described(frame, std::move(image.bytes));
  std::visit(
      [&]<class T>(const ImageView<T>& pixels) {
        const std::size_t row_bytes = static_cast<std::size_t>(pixels.width) * sizeof(T);
        image.bytes.resize(row_bytes * static_cast<std::size_t>(pixels.height));
        for (int y = 0; y < pixels.height; ++y)
          std::memcpy(image.bytes.data() + static_cast<std::size_t>(y) * row_bytes, pixels.row(y), row_bytes);
      },
      frame.image());
}

Result<FrameImage> raw_of(const Frame& frame) {
  FrameImage image;
  copy_raw(frame, image);
  return image;
}

GreyView view_of(const FrameImage& image) {
  if (image.bits == 8) {
    return ImageView<std::uint8_t>{reinterpret_cast<const std::uint8_t*>(image.bytes.data()), image.width_px,
                                   image.height_px, image.width_px};
  }
  return ImageView<std::uint16_t>{reinterpret_cast<const std::uint16_t*>(image.bytes.data()), image.width_px,
                                  image.height_px, image.width_px};
}

Result<FrameImage> image_of(const Frame& frame, FrameCoding coding, std::string camera) {
  auto image = coding == FrameCoding::kPng ? png_of(frame) : raw_of(frame);
  if (image) image->camera = std::move(camera);
  return image;
}

}  // namespace slsd
