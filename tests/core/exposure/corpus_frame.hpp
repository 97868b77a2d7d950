// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <variant>

#include "core/image.hpp"
#include "drivers/files/read_image.hpp"

namespace slsd {

/// A frame of tests/corpus, 8 bits.
inline Grey8 corpus_frame(const std::string& scene) {
  auto image = read_image(std::string(SLSD_SOURCE_DIR) + "/tests/corpus/" + scene + "/frame.png");
  return image ? std::get<Grey8>(*image) : Grey8();
}

/// The same scene under another exposure, in a room with more light: what is above full is clipped.
template <class Pixel = std::uint8_t>
Image<Pixel> exposed(const Grey8& frame, double brighter, double ambient = 0, double full = 255) {
  Image<Pixel> image(frame.width(), frame.height());
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const double level = std::min(255.0, brighter * (frame.data()[i] + ambient));
    image.data()[i] = static_cast<Pixel>(std::lround(level * full / 255.0));
  }
  return image;
}

/// The mean of squares of side 2 radius + 1, three times: near a Gaussian of sigma sqrt(radius (radius + 1)).
inline Grey8 blurred(Grey8 frame, int radius) {
  const auto pass = [&](int dx, int dy) {
    Grey8 out(frame.width(), frame.height());
    for (int y = 0; y < frame.height(); ++y) {
      for (int x = 0; x < frame.width(); ++x) {
        int sum = 0;
        for (int i = -radius; i <= radius; ++i) {
          sum += frame.at(std::clamp(x + i * dx, 0, frame.width() - 1), std::clamp(y + i * dy, 0, frame.height() - 1));
        }
        out.at(x, y) = static_cast<std::uint8_t>(sum / (2 * radius + 1));
      }
    }
    frame = std::move(out);
  };
  for (int i = 0; i < 3; ++i) {
    pass(1, 0);
    pass(0, 1);
  }
  return frame;
}

}  // namespace slsd
