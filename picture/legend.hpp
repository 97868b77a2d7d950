// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "picture/canvas.hpp"

namespace slsd {

/// Words in a row, each behind its mark; wraps at the picture's border.
/// @thread thread-bound
class Legend {
 public:
  /// @param top      of the legend, picture px
  /// @param text_px  height of a capital letter
  Legend(ColourImage& picture, int top, double text_px);

  void disc(Rgb colour, const std::string& words);
  void plus(Rgb colour, const std::string& words);
  void line(Rgb colour, const std::string& words);
  void dashes(Rgb colour, const std::string& words);

 private:
  /// Makes room for the words and their mark; returns the mark's centre.
  Eigen::Vector2d begin(const std::string& words);
  void write(const std::string& words);

  Canvas canvas_;
  double text_px_;
  double width_px_;
  Eigen::Vector2d place_;
};

}  // namespace slsd
