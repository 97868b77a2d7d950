// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/view_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <Eigen/Geometry>

#include "picture/canvas.hpp"

namespace slsd {
namespace {

constexpr Rgb kLine{70, 70, 70};
constexpr Rgb kFrame{255, 255, 255};
constexpr Rgb kBlack{0, 0, 0};
constexpr int kPitchPx = 64;

/// One of the depths at which a view is drawn.
struct Depth {
  const char* name;
  double mm;
  int thickness_px;
};

std::vector<Eigen::Vector2d> border_of(const Lens& lens, double step_px) {
  const double right = lens.width_px - 1, bottom = lens.height_px - 1;
  const std::array<Eigen::Vector2d, 5> corners{Eigen::Vector2d(0, 0), Eigen::Vector2d(right, 0),
                                               Eigen::Vector2d(right, bottom), Eigen::Vector2d(0, bottom),
                                               Eigen::Vector2d(0, 0)};
  std::vector<Eigen::Vector2d> border;
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    const Eigen::Vector2d along = corners[i + 1] - corners[i];
    const int steps = std::max(1, static_cast<int>(along.norm() / step_px));
    for (int step = 0; step < steps; ++step) border.push_back(corners[i] + along * step / steps);
  }
  border.push_back(corners[0]);
  return border;
}

bool is_near(const Lens& projector, const Eigen::Vector2d& pixel) {
  return std::abs(pixel.x() - projector.cx) < 2 * projector.width_px &&
         std::abs(pixel.y() - projector.cy) < 2 * projector.height_px;
}

void draw_lines(ColourImage& picture) {
  Canvas canvas(picture);
  const int width = picture.width(), height = picture.height();
  for (int x = width / 2 % kPitchPx; x < width; x += kPitchPx) canvas.rectangle(x, 0, 1, height, kLine);
  for (int y = height / 2 % kPitchPx; y < height; y += kPitchPx) canvas.rectangle(0, y, width, 1, kLine);
  canvas.rectangle(0, 0, width, 1, kFrame);
  canvas.rectangle(0, height - 1, width, 1, kFrame);
  canvas.rectangle(0, 0, 1, height, kFrame);
  canvas.rectangle(width - 1, 0, 1, height, kFrame);
}

// Beside the first point of the outline with room for the words.
void name_outline(ColourImage& picture, const std::vector<Eigen::Vector2d>& outline, const std::string& words) {
  Canvas canvas(picture);
  const double height_px = std::max(9.0, picture.height() / 50.0);
  const double width_px = Canvas::text_width_px(words, height_px);
  for (const Eigen::Vector2d& place : outline) {
    const Eigen::Vector2d base = place + Eigen::Vector2d(0.7, 1.8) * height_px;
    if (base.x() < 0 || base.x() + width_px >= picture.width()) continue;
    if (base.y() < height_px || base.y() + height_px >= picture.height()) continue;
    canvas.rectangle(static_cast<int>(base.x()), static_cast<int>(base.y() - 1.2 * height_px),
                     static_cast<int>(width_px), static_cast<int>(1.6 * height_px), kBlack);
    return canvas.text(base, words, height_px, kFrame);
  }
}

void draw_view(ColourImage& picture, const Calibration& calibration, const CalibratedCamera& camera,
               const Depth& depth) {
  const auto outline = outline_of_view(calibration, camera, depth.mm);
  Canvas canvas(picture);
  for (std::size_t i = 0; i + 1 < outline.size(); ++i) {
    const double gap = (outline[i + 1] - outline[i]).norm();  // points were left out here
    if (gap < picture.width() / 2.0) canvas.line(outline[i], outline[i + 1], kFrame, depth.thickness_px);
  }
  name_outline(picture, outline, camera.name + " " + depth.name + " " + std::to_string(std::lround(depth.mm)) + " mm");
}

}  // namespace

std::vector<Eigen::Vector2d> outline_of_view(const Calibration& calibration, const CalibratedCamera& camera,
                                             double depth_mm, double step_px) {
  std::vector<Eigen::Vector2d> outline;
  for (const Eigen::Vector2d& pixel : border_of(camera.lens, step_px)) {
    const Eigen::Vector2d direction = camera.lens.undistort(pixel);
    const Eigen::Vector3d point = camera.projector_from_camera * (depth_mm * direction.homogeneous());
    if (point.z() <= 0) continue;
    const Eigen::Vector2d seen = calibration.projector.project(point);
    if (is_near(calibration.projector, seen)) outline.push_back(seen);
  }
  return outline;
}

Grey8 draw_view_grid(const Calibration& calibration, double depth_min_mm, double depth_max_mm) {
  ColourImage picture(calibration.projector.width_px, calibration.projector.height_px);
  draw_lines(picture);
  const std::array<Depth, 3> depths{Depth{"near", depth_min_mm, 5},
                                    Depth{"middle", (depth_min_mm + depth_max_mm) / 2, 3},
                                    Depth{"far", depth_max_mm, 1}};
  for (const CalibratedCamera& camera : calibration.cameras) {
    for (const Depth& depth : depths) draw_view(picture, calibration, camera, depth);
  }
  Grey8 grid(picture.width(), picture.height());
  for (std::size_t i = 0; i < grid.size(); ++i) grid.data()[i] = picture.data()[i][0];
  return grid;
}

}  // namespace slsd
