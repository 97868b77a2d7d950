// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/canvas.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace slsd {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kFontHeightPx = 21.0;  // of a capital at scale 1
constexpr int kFractionBits = 4;

cv::Mat matrix(ColourImage& picture) {
  return {picture.height(), picture.width(), CV_8UC3, picture.data()};
}

cv::Scalar scalar(Rgb colour) {
  return {double(colour[0]), double(colour[1]), double(colour[2])};
}

// Far outside OpenCV's fixed point would wrap.
int fixed(double value) {
  return static_cast<int>(std::lround(std::clamp(value, -30000.0, 30000.0) * (1 << kFractionBits)));
}

cv::Point fixed(const Eigen::Vector2d& place) {
  return {fixed(place.x()), fixed(place.y())};
}

int stroke_px(double height_px) {
  return std::max(1, static_cast<int>(std::lround(height_px / 11.0)));
}

std::string printable(std::string words) {
  std::replace_if(
      words.begin(), words.end(), [](char c) { return c < 0x20 || c > 0x7e; }, '?');
  return words;
}

}  // namespace

void Canvas::line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, Rgb colour, int thickness_px) {
  cv::line(matrix(picture_), fixed(from), fixed(to), scalar(colour), thickness_px, cv::LINE_AA, kFractionBits);
}

void Canvas::dashes(const Eigen::Vector2d& from, const Eigen::Vector2d& to, Rgb colour, int thickness_px,
                    double dash_px) {
  const double length = (to - from).norm();
  for (double at = 0; at < length; at += 2 * dash_px) {
    const double end = std::min(at + dash_px, length);
    line(from + at / length * (to - from), from + end / length * (to - from), colour, thickness_px);
  }
}

void Canvas::disc(const Eigen::Vector2d& centre, double radius_px, Rgb colour) {
  cv::circle(matrix(picture_), fixed(centre), fixed(radius_px), scalar(colour), cv::FILLED, cv::LINE_AA, kFractionBits);
}

void Canvas::plus(const Eigen::Vector2d& centre, double arm_px, Rgb colour, int thickness_px) {
  const Eigen::Vector2d across(arm_px, 0), down(0, arm_px);
  line(centre - across, centre + across, colour, thickness_px);
  line(centre - down, centre + down, colour, thickness_px);
}

void Canvas::rectangle(int left, int top, int width, int height, Rgb colour) {
  cv::rectangle(matrix(picture_), cv::Rect(left, top, width, height), scalar(colour), cv::FILLED);
}

void Canvas::text(const Eigen::Vector2d& place, const std::string& words, double height_px, Rgb colour, Align align) {
  const double share = align == Align::kLeft ? 0.0 : align == Align::kCentre ? 0.5 : 1.0;
  const double left = place.x() - share * text_width_px(words, height_px);
  const cv::Point origin(static_cast<int>(std::lround(left)), static_cast<int>(std::lround(place.y())));
  cv::putText(matrix(picture_), printable(words), origin, kFont, height_px / kFontHeightPx, scalar(colour),
              stroke_px(height_px), cv::LINE_AA);
}

double Canvas::text_width_px(const std::string& words, double height_px) {
  return cv::getTextSize(printable(words), kFont, height_px / kFontHeightPx, stroke_px(height_px), nullptr).width;
}

Rgb mix(Rgb a, Rgb b, double share) {
  Rgb mixed;
  for (std::size_t i = 0; i < 3; ++i) {
    mixed[i] = static_cast<std::uint8_t>(std::lround(a[i] + std::clamp(share, 0.0, 1.0) * (b[i] - a[i])));
  }
  return mixed;
}

}  // namespace slsd
