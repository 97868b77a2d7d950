// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <variant>

#include "core/image.hpp"

namespace slsd {

/// An owned grey image of 8 or 16 bits a pixel.
using GreyImage = std::variant<Grey8, Grey16>;

[[nodiscard]] inline GreyView view(const GreyImage& image) {
  return std::visit([](const auto& pixels) { return GreyView(pixels.view()); }, image);
}

}  // namespace slsd
