// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/frame_image.hpp"

#include <variant>

#include "drivers/files/encode_png.hpp"
#include "picture/draw_decoding.hpp"

namespace slsd {
namespace {

template <class T>
std::string bytes_of(const ImageView<T>& image) {
  std::string bytes;
  bytes.reserve(static_cast<std::size_t>(image.width) * image.height * sizeof(T));
  for (int y = 0; y < image.height; ++y) {
    bytes.append(reinterpret_cast<const char*>(image.row(y)), static_cast<std::size_t>(image.width) * sizeof(T));
  }
  return bytes;
}

FrameImage described(const Frame& frame) {
  return std::visit(
      [&]<class T>(const ImageView<T>& image) {
        return FrameImage{.bytes = {},
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

Result<FrameImage> raw_of(const Frame& frame) {
  FrameImage image = described(frame);
  image.bytes = std::visit([](const auto& pixels) { return bytes_of(pixels); }, frame.image());
  return image;
}

Result<FrameImage> image_of(const Frame& frame, FrameCoding coding, std::string camera) {
  auto image = coding == FrameCoding::kPng ? png_of(frame) : raw_of(frame);
  if (image) image->camera = std::move(camera);
  return image;
}

Result<std::string> picture_of(const GreyView& image, const Decoding& decoding, const Pattern& pattern) {
  return encode_png(draw_decoding(image, decoding, pattern));
}

}  // namespace slsd
