// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/pixel_digits.hpp"

#include <array>

namespace slsd {
namespace {

constexpr int kColumns = 3;
constexpr int kRows = 5;
constexpr int kPitch = kColumns + 1;
constexpr std::string_view kLetters = "0123456789x";
constexpr std::array<std::string_view, 11> kSquares{
    "#### ## ## ####", " # ##  #  # ###", "###  #####  ###", "###  # ##  ####", "# ## ####  #  #", "####  ###  ####",
    "####  #### ####", "###  #  #  #  #", "#### ##### ####", "#### ####  ####", "   # # # # #   "};

void fill_square(Grey8& image, int left, int top, int side) {
  for (int y = top; y < top + side; ++y) {
    for (int x = left; x < left + side; ++x) {
      if (image.view().contains(x, y)) image.at(x, y) = 255;
    }
  }
}

}  // namespace

void draw_pixel_digits(Grey8& image, int left, int top, int square_px, std::string_view digits) {
  for (const char digit : digits) {
    const std::size_t letter = kLetters.find(digit);
    for (int i = 0; letter < kSquares.size() && i < kColumns * kRows; ++i) {
      if (kSquares[letter][static_cast<std::size_t>(i)] != '#') continue;
      fill_square(image, left + i % kColumns * square_px, top + i / kColumns * square_px, square_px);
    }
    left += kPitch * square_px;
  }
}

int pixel_digits_width(int square_px, std::string_view digits) {
  return digits.empty() ? 0 : (static_cast<int>(digits.size()) * kPitch - 1) * square_px;
}

}  // namespace slsd
