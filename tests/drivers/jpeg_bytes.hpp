// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/image.hpp"

namespace slsd::test {

/// Which JPEG is made of an image.
struct JpegKind {
  int components = 3;         ///< 1 grey; 3 YCbCr, chroma halved both ways; 4 CMYK
  Rgb shares{255, 255, 255};  ///< of the grey in each colour of three, of 255
  int restart_interval = 0;   ///< in units of blocks
  bool progressive = false;
  bool arithmetic = false;
  int quality = 90;
};

/// Encoded by libjpeg; grey in every component, times its share.
[[nodiscard]] std::string jpeg_bytes(const Grey8& image, const JpegKind& kind = {});

/// Blobs and edges of every scale, which take a JPEG as much as a camera's frame does.
[[nodiscard]] Grey8 busy_image(int width, int height);

/// Where the coded data of a JPEG's first scan begins.
[[nodiscard]] std::size_t scan_begin(const std::string& jpeg);
/// Without the segments of that marker in its header.
[[nodiscard]] std::string without_segments(const std::string& jpeg, unsigned char marker);

}  // namespace slsd::test
