// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "docs/tables/alphabet_picture.hpp"

#include <algorithm>
#include <iterator>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/code/symbol.hpp"

namespace slsd {
namespace {

constexpr int kZoom = 3;
constexpr int kCell_px = 16 * kZoom + 12;
constexpr int kLeft_px = 64;
constexpr int kTop_px = 34;

void write_text(cv::Mat& picture, const std::string& text, int left_px, int base_px) {
  cv::putText(picture, text, {left_px, base_px}, cv::FONT_HERSHEY_SIMPLEX, 0.5, 240, 1, cv::LINE_AA);
}

void paint_symbol(cv::Mat& picture, int number, int size_px, int left_px, int top_px) {
  const Grey8 drawing = draw_symbol(number, size_px);
  cv::rectangle(picture, {left_px, top_px, size_px * kZoom, size_px * kZoom}, 0, cv::FILLED);
  for (int y = 0; y < size_px; ++y)
    for (int x = 0; x < size_px; ++x)
      if (drawing.at(x, y) != 0)
        cv::rectangle(picture, {left_px + x * kZoom, top_px + y * kZoom, kZoom, kZoom}, 255, cv::FILLED);
}

}  // namespace

bool write_alphabet_picture(const std::string& file) {
  const int sizes = static_cast<int>(std::size(kSymbolSizesPx));
  cv::Mat picture(kTop_px + sizes * kCell_px, kLeft_px + kSymbolCount * kCell_px, CV_8UC1, cv::Scalar(110));
  for (int number = 1; number <= kSymbolCount; ++number)
    write_text(picture, std::to_string(number), kLeft_px + (number - 1) * kCell_px + 14, kTop_px - 10);
  for (int i = 0; i < sizes; ++i) {
    const int size_px = kSymbolSizesPx[sizes - 1 - i];
    const int margin_px = (kCell_px - size_px * kZoom) / 2;
    write_text(picture, std::to_string(size_px) + " px", 8, kTop_px + i * kCell_px + kCell_px / 2 + 5);
    for (int number = 1; number <= kSymbolCount; ++number)
      paint_symbol(picture, number, size_px, kLeft_px + (number - 1) * kCell_px + margin_px,
                   kTop_px + i * kCell_px + margin_px);
  }
  return cv::imwrite(file, picture);
}

}  // namespace slsd
