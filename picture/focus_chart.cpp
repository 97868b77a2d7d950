// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/focus_chart.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "picture/pixel_digits.hpp"

namespace slsd {
namespace {

constexpr std::uint8_t kLit = 255;
constexpr int kSpokes = 18;
constexpr int kGapPx = 4;

class FocusChart {
 public:
  FocusChart(int width_px, int height_px)
      : chart_(width_px, height_px), star_radius_(std::min(width_px, height_px) / 14) {}

  Grey8 draw() {
    const int width = chart_.width(), height = chart_.height();
    frame(0);
    frame(height / 20);
    cross();
    const int margin = height / 20 + kGapPx + star_radius_;
    for (const int y : {margin, height - 1 - margin}) {
      target(margin, y, +1);
      target(width - 1 - margin, y, -1);
    }
    target(width / 2, height / 2, +1);
    size();
    return std::move(chart_);
  }

 private:
  void set(int x, int y, bool lit) {
    if (chart_.view().contains(x, y)) chart_.at(x, y) = lit ? kLit : std::uint8_t{0};
  }

  void fill(int left, int top, int right, int bottom) {
    for (int y = top; y <= bottom; ++y) {
      for (int x = left; x <= right; ++x) set(x, y, true);
    }
  }

  void frame(int inset) {
    const int right = chart_.width() - 1 - inset, bottom = chart_.height() - 1 - inset;
    fill(inset, inset, right, inset);
    fill(inset, bottom, right, bottom);
    fill(inset, inset, inset, bottom);
    fill(right, inset, right, bottom);
  }

  void cross() {
    const int right = chart_.width() - 1, bottom = chart_.height() - 1;
    fill(right / 2, 0, (right + 1) / 2, bottom);
    fill(0, bottom / 2, right, (bottom + 1) / 2);
  }

  // Each spoke and each gap is a kSpokes-th of half a turn.
  void star(int centre_x, int centre_y) {
    for (int y = -star_radius_; y <= star_radius_; ++y) {
      for (int x = -star_radius_; x <= star_radius_; ++x) {
        if (x * x + y * y > star_radius_ * star_radius_) continue;
        const double turns = std::atan2(y, x) / (2.0 * std::numbers::pi) + 1.0;
        set(centre_x + x, centre_y + y, static_cast<int>(turns * 2 * kSpokes) % 2 == 0);
      }
    }
  }

  void lines(int left, int top, int side, int thickness, bool upright) {
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) set(left + x, top + y, (upright ? x : y) / thickness % 2 == 0);
    }
  }

  // Draws a star and the lines beside it; to the right if side = 1.
  void target(int centre_x, int centre_y, int side) {
    star(centre_x, centre_y);
    const int block = star_radius_ - kGapPx / 2;
    const int beside = star_radius_ + kGapPx;
    const int left = side > 0 ? centre_x + beside : centre_x - beside - 2 * block - kGapPx + 1;
    for (const int thickness : {1, 2}) {
      const int top = thickness == 1 ? centre_y - star_radius_ : centre_y - star_radius_ + block + kGapPx;
      lines(left, top, block, thickness, true);
      lines(left + block + kGapPx, top, block, thickness, false);
    }
  }

  void size() {
    const std::string text = std::to_string(chart_.width()) + "x" + std::to_string(chart_.height());
    const int square = std::max(1, star_radius_ / 8);
    const int left = chart_.width() / 2 + kGapPx + square;
    draw_pixel_digits(chart_, left, chart_.height() / 2 + star_radius_ + 2 * kGapPx, square, text);
  }

  Grey8 chart_;
  int star_radius_;
};

}  // namespace

Grey8 draw_focus_chart(int width_px, int height_px) {
  return FocusChart(width_px, height_px).draw();
}

}  // namespace slsd
