// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/cloud/render_cloud.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/geometry/robust.hpp"
#include "picture/canvas.hpp"
#include "picture/cloud/relief.hpp"
#include "picture/cloud/room.hpp"
#include "picture/cloud/surface.hpp"
#include "picture/cloud/view.hpp"
#include "picture/depth_colour.hpp"
#include "picture/ticks.hpp"

namespace slsd {
namespace {

constexpr Rgb kTop{255, 255, 255};
constexpr Rgb kBottom{232, 236, 243};
constexpr Rgb kInk{44, 50, 66};
constexpr double kTrimmedShare = 0.01;  // share of depths cut at either end of the colours
constexpr double kLeastSpan = 0.008;    // as a share of the depth
constexpr float kFarthestMm = 1e6F;
constexpr double kDotBrightness = 0.72;
constexpr Rgb kSoftInk{104, 112, 130};

// The range of depths that the colours cover, mm.
using DepthRange = std::pair<double, double>;

double share_of(const DepthRange& range, double depth_mm) {
  return (depth_mm - range.first) / std::max(range.second - range.first, 1e-9);
}

// The range of nearly all depths; wide enough that noise on a flat plane does not use all colours.
DepthRange depths_within(const Surface& surface, const Box& box) {
  std::vector<double> depths;
  for (const Eigen::Vector3d& point : surface.points) {
    if (box.contains(point)) depths.push_back(point.z());
  }
  if (depths.empty()) return {box.low.z(), box.high.z()};
  std::sort(depths.begin(), depths.end());
  const auto trimmed = static_cast<std::size_t>(kTrimmedShare * static_cast<double>(depths.size()));
  const double low = depths[trimmed], high = depths[depths.size() - 1 - trimmed];
  const double missing = std::max(0.0, kLeastSpan * std::abs(high) - (high - low));
  return {low - 0.5 * missing, high + 0.5 * missing};
}

// A cloud may come from a file: infinite or absurdly far points cannot be drawn.
Cloud drawable(Cloud cloud) {
  std::erase_if(cloud.points, [](const CloudPoint& point) {
    const auto far = [](float value) { return !(std::abs(value) < kFarthestMm); };
    return far(point.x) || far(point.y) || far(point.z);
  });
  return cloud;
}

ColourImage background(CloudPictureSize size) {
  ColourImage picture(size.width_px, size.height_px);
  for (int y = 0; y < size.height_px; ++y) {
    std::fill_n(picture.row(y), size.width_px, mix(kTop, kBottom, static_cast<double>(y) / size.height_px));
  }
  return picture;
}

// Typical distance of two joined points, mm.
double spacing_mm(const Surface& surface) {
  std::vector<double> lengths;
  for (const auto& triangle : surface.triangles) {
    lengths.push_back((surface.points[triangle[0]] - surface.points[triangle[1]]).norm());
  }
  return lengths.empty() ? 10.0 : median_in_place(lengths);
}

void draw_surface(ColourImage& picture, const Surface& surface, const View& view, const Box& box,
                  const DepthRange& depths) {
  Relief relief(picture.width(), picture.height(), view.forward());
  const auto vertex = [&](std::uint32_t i) {
    const bool joined = surface.normals[i].norm() > 0;
    return ReliefVertex{view.place(surface.points[i]), joined ? surface.normals[i] : Eigen::Vector3d(-view.forward()),
                        share_of(depths, surface.points[i].z())};
  };
  const auto shown = [&](std::uint32_t i) { return box.contains(surface.points[i]); };
  for (const auto& triangle : surface.triangles) {
    if (!std::all_of(triangle.begin(), triangle.end(), shown)) continue;
    relief.triangle({vertex(triangle[0]), vertex(triangle[1]), vertex(triangle[2])});
  }
  const double spacing_px = spacing_mm(surface) * view.px_per_mm();
  for (std::uint32_t i = 0; i < surface.points.size(); ++i) {
    if (!shown(i)) continue;
    ReliefVertex point = vertex(i);
    const bool joined = surface.normals[i].norm() > 0;
    // Lifted off its surface, so that the whole disc is visible.
    if (joined) point.place.z() -= 0.3 * spacing_px, point.brightness = kDotBrightness;
    relief.disc(point, joined ? std::min(0.11 * spacing_px, 3.0) : std::clamp(0.3 * spacing_px, 1.0, 8.0));
  }
  relief.compose(picture, 2.0 * spacing_px);
}

void draw_colour_bar(Canvas& canvas, const CloudPictureSize& size, const DepthRange& depths, double text_px) {
  const int left = size.width_px - static_cast<int>(8.5 * text_px), width = static_cast<int>(1.3 * text_px);
  const int top = size.height_px / 4, height = size.height_px / 2;
  for (int y = 0; y < height; ++y) {
    canvas.rectangle(left, top + y, width, 1, depth_colour(static_cast<double>(y) / (height - 1)));
  }
  const double span = std::max(depths.second - depths.first, 1e-3);
  const double step = tick_step(span, 6);
  for (const double tick : ticks(depths.first, depths.second, step)) {
    const double y = top + (tick - depths.first) / span * (height - 1);
    canvas.line({left + width + 0.2 * text_px, y}, {left + width + 0.7 * text_px, y}, kSoftInk);
    canvas.text({left + width + 1.1 * text_px, y + 0.5 * text_px}, tick_label(tick, step), text_px, kSoftInk);
  }
  canvas.text({left + 2.5 * text_px, top - 1.2 * text_px}, "depth z (mm)", text_px, kInk, Align::kCentre);
}

void draw_scale_bar(Canvas& canvas, const CloudPictureSize& size, const View& view, double text_px) {
  const double length_mm = tick_step(0.05 * size.width_px / view.px_per_mm(), 1);
  const double length_px = length_mm * view.px_per_mm();
  const Eigen::Vector2d left(2.5 * text_px, size.height_px - 3.0 * text_px);
  const Eigen::Vector2d right = left + Eigen::Vector2d(length_px, 0), up(0, 0.45 * text_px);
  canvas.line(left, right, kInk, 2);
  canvas.line(left - up, left + up, kInk, 2);
  canvas.line(right - up, right + up, kInk, 2);
  canvas.text(0.5 * (left + right) - Eigen::Vector2d(0, text_px), tick_label(length_mm, length_mm) + " mm", text_px,
              kInk, Align::kCentre);
}

void draw_title(Canvas& canvas, const Cloud& cloud, std::size_t points, double text_px) {
  canvas.text({2.5 * text_px, 3.6 * text_px}, std::to_string(points) + " points", 1.7 * text_px, kInk);
  const std::string scan = cloud.scan_id.empty() ? std::string() : "scan " + cloud.scan_id;
  canvas.text({2.5 * text_px, 5.8 * text_px}, scan + (scan.empty() ? "" : "   ") + cloud.time, text_px, kSoftInk);
}

}  // namespace

ColourImage render_cloud(const Cloud& whole, CloudPictureSize size, std::optional<std::size_t> measured) {
  const Cloud cloud = drawable(whole);
  const double text_px = std::max(6.0, size.height_px / 85.0);
  const View::Frame frame{9.5 * text_px, 7.5 * text_px, size.width_px - 21.5 * text_px, size.height_px - 15 * text_px};
  ColourImage picture = background(size);
  const Box box = box_of(cloud);
  const View view(box, frame);
  const Surface surface = join_surface(cloud);
  const DepthRange depths = depths_within(surface, box);
  draw_room(picture, view, box, surface);
  draw_surface(picture, surface, view, box, depths);
  Canvas canvas(picture);
  draw_axes(canvas, view, box, text_px);
  draw_colour_bar(canvas, size, depths, text_px);
  draw_scale_bar(canvas, size, view, text_px);
  draw_title(canvas, cloud, measured.value_or(cloud.points.size()), text_px);
  return picture;
}

}  // namespace slsd
