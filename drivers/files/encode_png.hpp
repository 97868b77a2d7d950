// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// Encodes a PNG file: 8 or 16 bits of grey, or 8 bits each of red, green and blue. Lossless.
/// @errors kInvalidArgument (an empty image), kIo (the encoder failed)
/// @thread reentrant
[[nodiscard]] Result<std::string> encode_png(const Grey8& image);
/// @param dpi  pixels per inch, stored in the file
[[nodiscard]] Result<std::string> encode_png(const Grey8& image, double dpi);
[[nodiscard]] Result<std::string> encode_png(const Grey16& image);
[[nodiscard]] Result<std::string> encode_png(const ColourImage& image);
[[nodiscard]] Result<std::string> encode_png(const GreyView& image);

}  // namespace slsd
