// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/corpus/dense_steps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "picture/canvas.hpp"
#include "picture/depth_colour.hpp"

namespace slsd {
namespace {

constexpr int kScale = 3, kTitlePx = 34, kGapPx = 10, kColumns = 3;
constexpr double kTextPx = 15;
constexpr Rgb kWhite{255, 255, 255}, kInk{30, 30, 30}, kNone{235, 235, 238};

/// Of DensePixel.
constexpr std::array<Rgb, kDensePixelCount> kReasonColours{Rgb{214, 224, 214}, Rgb{60, 60, 70},    Rgb{200, 70, 60},
                                                           Rgb{240, 220, 80},  Rgb{120, 80, 160},  Rgb{230, 150, 60},
                                                           Rgb{70, 110, 190},  Rgb{190, 110, 180}, Rgb{110, 170, 110}};

class Panels {
 public:
  Panels(const FramePart& part, int count)
      : part_(part),
        rows_((count + kColumns - 1) / kColumns),
        picture_(kColumns * (kScale * part.width + kGapPx) + kGapPx,
                 rows_ * (kScale * part.height + kTitlePx + kGapPx) + kGapPx, kWhite) {}

  /// The next panel. @param colour_of  (x, y) of the frame: its colour
  template <class ColourOf>
  void add(const std::string& title, const ColourOf& colour_of) {
    left_ = kGapPx + (added_ % kColumns) * (kScale * part_.width + kGapPx);
    top_ = kGapPx + (added_ / kColumns) * (kScale * part_.height + kTitlePx + kGapPx);
    ++added_;
    Canvas(picture_).text({static_cast<double>(left_), static_cast<double>(top_) + kTitlePx - 10}, title, kTextPx,
                          kInk);
    top_ += kTitlePx;
    for (int y = 0; y < kScale * part_.height; ++y)
      for (int x = 0; x < kScale * part_.width; ++x)
        picture_.at(left_ + x, top_ + y) = colour_of(part_.left + x / kScale, part_.top + y / kScale);
  }
  /// In the last one. @param x, y  of the frame
  void disc(float x, float y, double radius_px, Rgb colour) {
    const double in_x = static_cast<double>(x) - part_.left, in_y = static_cast<double>(y) - part_.top;
    if (in_x < 0 || in_y < 0 || in_x >= part_.width || in_y >= part_.height) return;
    Canvas(picture_).disc({left_ + kScale * (in_x + 0.5), top_ + kScale * (in_y + 0.5)}, radius_px, colour);
  }
  [[nodiscard]] ColourImage take() { return std::move(picture_); }

 private:
  FramePart part_;
  int rows_, added_ = 0, left_ = 0, top_ = 0;
  ColourImage picture_;
};

Rgb grey(double share) {
  const auto level = static_cast<std::uint8_t>(std::lround(255 * std::clamp(share, 0.0, 1.0)));
  return {level, level, level};
}

}  // namespace

ColourImage draw_dense_steps(const GreyView& frame, const DenseMapper& mapper, const DenseMap& map,
                             const FramePart& part) {
  const auto index = [&](int x, int y) { return static_cast<std::size_t>(y) * map.width + x; };
  double nearest = 1e9, farthest = 0;
  for (int y = part.top; y < part.top + part.height; ++y) {
    for (int x = part.left; x < part.left + part.width; ++x) {
      if (!map.measured(index(x, y))) continue;
      nearest = std::min(nearest, static_cast<double>(map.depth_mm[index(x, y)]));
      farthest = std::max(farthest, static_cast<double>(map.depth_mm[index(x, y)]));
    }
  }
  const auto colour_at = [&](double depth_mm) {
    return depth_colour((depth_mm - nearest) / std::max(1.0, farthest - nearest));
  };
  const auto level = [&](int x, int y) {
    return std::visit([&](const auto& pixels) { return static_cast<double>(pixels.at(x, y)); }, frame) / 255;
  };
  Panels panels(part, 6);
  panels.add("1  frame and seeds", [&](int x, int y) { return mix(grey(level(x, y)), kWhite, 0.3); });
  for (const SurfaceSeed& seed : mapper.seeds())
    panels.disc(seed.camera_px.x(), seed.camera_px.y(), 5,
                colour_at(1 / static_cast<double>(seed.plane.inverse_depth)));
  const SurfaceGrid& grid = mapper.grid();
  panels.add("2  grown: a plane to a node", [](int, int) { return kNone; });
  for (int row = 0; row < grid.rows(); ++row)
    for (int column = 0; column < grid.columns(); ++column)
      if (const SurfaceNode* node = grid.good(column, row))
        panels.disc(static_cast<float>(grid.x_of(column)), static_cast<float>(grid.y_of(row)), 4,
                    colour_at(1 / static_cast<double>(node->plane.inverse_depth)));
  panels.add("3  judged and cleaned",
             [&](int x, int y) { return kReasonColours[static_cast<std::size_t>(map.pixels[index(x, y)])]; });
  panels.add("4  depth", [&](int x, int y) {
    return map.measured(index(x, y)) ? colour_at(static_cast<double>(map.depth_mm[index(x, y)])) : kNone;
  });
  panels.add("5  relief", [&](int x, int y) {
    const int beside_x = std::min(x + 1, map.width - 1), beside_y = std::min(y + 1, map.height - 1);
    if (!map.measured(index(x, y)) || !map.measured(index(beside_x, beside_y))) return kNone;
    const double slope = static_cast<double>(map.depth_mm[index(beside_x, beside_y)] - map.depth_mm[index(x, y)]);
    return grey(0.6 - 0.35 * std::clamp(slope, -1.5, 1.5));
  });
  panels.add("6  sigma, white 0 to black 1 mm", [&](int x, int y) {
    return map.measured(index(x, y)) ? grey(1 - static_cast<double>(map.sigma_mm[index(x, y)])) : Rgb{250, 225, 225};
  });
  return panels.take();
}

}  // namespace slsd
