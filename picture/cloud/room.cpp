// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/cloud/room.hpp"

#include <array>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "picture/cloud/relief.hpp"
#include "picture/ticks.hpp"

namespace slsd {
namespace {

constexpr int kMostTicks = 6;
constexpr Rgb kGrid{212, 217, 226};
constexpr Rgb kFrame{150, 158, 174};
constexpr Rgb kText{70, 78, 96};
constexpr double kShadow = 0.30;

// A side of the box behind the cloud, facing the viewer.
struct Side {
  int axis;      // the axis perpendicular to the side
  bool at_high;  // whether it lies at the box's high end
  Rgb colour;
};
constexpr std::array<Side, 3> kSides{
    {{2, true, {250, 251, 253}}, {0, false, {243, 245, 249}}, {1, true, {236, 239, 245}}}};

double place_of(const Side& side, const Box& box) {
  return side.at_high ? box.high[side.axis] : box.low[side.axis];
}

double step_of(const Box& box) {
  return tick_step(box.size().maxCoeff(), kMostTicks);
}

// The point of the side at shares (a, b) of the two other axes.
Eigen::Vector3d on_side(const Side& side, const Box& box, double a, double b) {
  const int first = (side.axis + 1) % 3, second = (side.axis + 2) % 3;
  Eigen::Vector3d point;
  point[side.axis] = place_of(side, box);
  point[first] = box.low[first] + a * box.size()[first];
  point[second] = box.low[second] + b * box.size()[second];
  return point;
}

cv::Point pixel(const View& view, const Eigen::Vector3d& point) {
  const Eigen::Vector2d place = view.flat(point);
  return {static_cast<int>(std::lround(place.x())), static_cast<int>(std::lround(place.y()))};
}

std::vector<cv::Point> outline(const Side& side, const View& view, const Box& box) {
  return {pixel(view, on_side(side, box, 0, 0)), pixel(view, on_side(side, box, 1, 0)),
          pixel(view, on_side(side, box, 1, 1)), pixel(view, on_side(side, box, 0, 1))};
}

cv::Mat matrix(ColourImage& picture) {
  return {picture.height(), picture.width(), CV_8UC3, picture.data()};
}

void fill(ColourImage& picture, const std::vector<cv::Point>& corners, Rgb colour) {
  cv::fillConvexPoly(matrix(picture), corners, cv::Scalar(colour[0], colour[1], colour[2]), cv::LINE_AA);
}

void draw_grid(Canvas& canvas, const Side& side, const View& view, const Box& box) {
  for (const int along : {1, 2}) {
    const int axis = (side.axis + along) % 3;
    for (const double tick : ticks(box.low[axis], box.high[axis], step_of(box))) {
      Eigen::Vector3d from = on_side(side, box, 0, 0), to = on_side(side, box, 1, 1);
      from[axis] = to[axis] = tick;
      canvas.line(view.flat(from), view.flat(to), kGrid);
    }
  }
}

// The surface's soft shadow on a side; 255 is full shadow.
cv::Mat shadow_on(const Side& side, const cv::Size& size, const View& view, const Box& box, const Surface& surface) {
  const Eigen::Vector3d light = light_direction();
  cv::Mat shadow = cv::Mat::zeros(size, CV_8U);
  const auto way = [&](std::uint32_t corner) {
    return (surface.points[corner][side.axis] - place_of(side, box)) / light[side.axis];
  };
  const auto thrown = [&](std::uint32_t corner) { return pixel(view, surface.points[corner] - way(corner) * light); };
  for (const auto& triangle : surface.triangles) {
    if (!(way(triangle[0]) > 0)) continue;
    cv::fillConvexPoly(shadow, std::vector{thrown(triangle[0]), thrown(triangle[1]), thrown(triangle[2])}, 255);
  }
  cv::GaussianBlur(shadow, shadow, {}, size.height / 100.0);
  return shadow;
}

void draw_shadow(ColourImage& picture, const Side& side, const View& view, const Box& box, const Surface& surface) {
  const cv::Size size(picture.width(), picture.height());
  const cv::Mat shadow = shadow_on(side, size, view, box, surface);
  cv::Mat within = cv::Mat::zeros(size, CV_8U);
  cv::fillConvexPoly(within, outline(side, view, box), 255, cv::LINE_AA);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const double share = shadow.at<std::uint8_t>(y, x) * within.at<std::uint8_t>(y, x) / 65025.0;
      if (share > 0) picture.at(x, y) = mix(picture.at(x, y), Rgb{60, 66, 90}, kShadow * share);
    }
  }
}

void draw_frame(Canvas& canvas, const Side& side, const View& view, const Box& box) {
  const std::array<Eigen::Vector2d, 4> corners{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d &from = corners[i], &to = corners[(i + 1) % 4];
    canvas.line(view.flat(on_side(side, box, from.x(), from.y())), view.flat(on_side(side, box, to.x(), to.y())),
                kFrame);
  }
}

// An edge of the box with numbers, and the place of the numbers beside it.
struct Edge {
  int axis;
  Eigen::Vector3d from;
  Eigen::Vector2d out;  // towards the numbers, of unit length in the picture
  Align align;
  const char* name;
};

void draw_edge(Canvas& canvas, const Edge& edge, const View& view, const Box& box, double text_px) {
  const double step = step_of(box);
  for (const double tick : ticks(box.low[edge.axis], box.high[edge.axis], step)) {
    Eigen::Vector3d point = edge.from;
    point[edge.axis] = tick;
    const Eigen::Vector2d place = view.flat(point);
    canvas.line(place, place + 0.5 * text_px * edge.out, kFrame);
    const Eigen::Vector2d base = place + 1.1 * text_px * edge.out + Eigen::Vector2d(0, 0.5 * text_px);
    canvas.text(base, tick_label(tick, step), text_px, kText, edge.align);
  }
  Eigen::Vector3d middle = edge.from;
  middle[edge.axis] = 0.5 * (box.low[edge.axis] + box.high[edge.axis]);
  canvas.text(view.flat(middle) + 4.6 * text_px * edge.out + Eigen::Vector2d(0, 0.5 * text_px), edge.name,
              1.1 * text_px, kText, edge.align);
}

}  // namespace

void draw_room(ColourImage& picture, const View& view, const Box& box, const Surface& surface) {
  Canvas canvas(picture);
  for (const Side& side : kSides) {
    fill(picture, outline(side, view, box), side.colour);
    draw_grid(canvas, side, view, box);
    draw_shadow(picture, side, view, box, surface);
    draw_frame(canvas, side, view, box);
  }
}

void draw_axes(Canvas& canvas, const View& view, const Box& box, double text_px) {
  const Eigen::Vector3d left_front(box.low.x(), box.high.y(), box.low.z());
  const Eigen::Vector3d right_front(box.high.x(), box.high.y(), box.low.z());
  draw_edge(canvas, {0, left_front, Eigen::Vector2d(-0.45, 0.89), Align::kRight, "x (mm)"}, view, box, text_px);
  draw_edge(canvas, {1, left_front, Eigen::Vector2d(-1.0, 0.0), Align::kRight, "y (mm)"}, view, box, text_px);
  draw_edge(canvas, {2, right_front, Eigen::Vector2d(0.45, 0.89), Align::kLeft, "z (mm)"}, view, box, text_px);
}

}  // namespace slsd
