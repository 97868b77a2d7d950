// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <variant>

#include "core/image.hpp"

namespace slsd {

/// An owned grey image of 8 or 16 bits per pixel.
using GreyImage = std::variant<Grey8, Grey16>;

[[nodiscard]] inline GreyView view(const GreyImage& image) {
  return std::visit([](const auto& pixels) { return GreyView(pixels.view()); }, image);
}

[[nodiscard]] inline GreyImage copy_of(const GreyView& borrowed) {
  return std::visit(
      []<class T>(const ImageView<T>& pixels) -> GreyImage {
        Image<T> image(pixels.width, pixels.height);
        for (int y = 0; y < pixels.height; ++y) std::copy_n(pixels.row(y), pixels.width, image.row(y));
        return image;
      },
      borrowed);
}

}  // namespace slsd
