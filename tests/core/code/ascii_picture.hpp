// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/image.hpp"

namespace slsd {

/// '#' where an image is lit, '.' where it is dark, a line to a row.
inline std::string ascii_picture(const Grey8& image) {
  std::string text;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) text += image.at(x, y) != 0 ? '#' : '.';
    text += '\n';
  }
  return text;
}

}  // namespace slsd
