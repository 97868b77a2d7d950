// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/legend.hpp"

namespace slsd {
namespace {

constexpr Rgb kLegendInk{222, 228, 238};

// In letter heights.
constexpr double kMarkWidth = 1.9;
constexpr double kEntryGap = 2.1;
constexpr double kLinePitch = 2.2;

}  // namespace

Legend::Legend(ColourImage& picture, int top, double text_px)
    : canvas_(picture), text_px_(text_px), width_px_(picture.width()), place_(text_px, top + 2 * text_px) {}

Eigen::Vector2d Legend::begin(const std::string& words) {
  const double end = place_.x() + kMarkWidth * text_px_ + Canvas::text_width_px(words, text_px_);
  if (end + text_px_ > width_px_ && place_.x() > text_px_) place_ = {text_px_, place_.y() + kLinePitch * text_px_};
  return place_ + text_px_ * Eigen::Vector2d(0.7, -0.5);
}

void Legend::write(const std::string& words) {
  canvas_.text(place_ + Eigen::Vector2d(kMarkWidth * text_px_, 0), words, text_px_, kLegendInk);
  place_.x() += (kMarkWidth + kEntryGap) * text_px_ + Canvas::text_width_px(words, text_px_);
}

void Legend::disc(Rgb colour, const std::string& words) {
  canvas_.disc(begin(words), 0.55 * text_px_, colour);
  write(words);
}

void Legend::plus(Rgb colour, const std::string& words) {
  canvas_.plus(begin(words), 0.6 * text_px_, colour, 2);
  write(words);
}

void Legend::line(Rgb colour, const std::string& words) {
  const Eigen::Vector2d mark = begin(words), half(0.7 * text_px_, 0);
  canvas_.line(mark - half, mark + half, colour, 2);
  write(words);
}

void Legend::dashes(Rgb colour, const std::string& words) {
  const Eigen::Vector2d mark = begin(words), half(0.7 * text_px_, 0);
  canvas_.dashes(mark - half, mark + half, colour, 2, 0.35 * text_px_);
  write(words);
}

}  // namespace slsd
