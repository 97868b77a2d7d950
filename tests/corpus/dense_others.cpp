// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/corpus/dense_others.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Core>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "core/decode/grid/lattice_frame.hpp"

namespace slsd {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr double kSideMostPitches = 2.2;  // of a triangle: across a symbol that is missing, not two
constexpr double kDepthMost = 0.04;       // within a triangle, of the depth
constexpr double kOfRange = 0.1;          // beyond the symbols' depths

cv::Mat matrix_of(const Lens& lens) {
  return (cv::Mat_<double>(3, 3) << lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1);
}

cv::Mat distortion_of(const Lens& lens) {
  cv::Mat distortion(1, 5, CV_64F);
  for (int i = 0; i < 5; ++i) distortion.at<double>(i) = lens.distortion[i];
  return distortion;
}

cv::Mat grey_of(const GreyView& frame, double full) {
  return std::visit(
      [&](const auto& pixels) {
        cv::Mat grey(pixels.height, pixels.width, CV_8U);
        for (int y = 0; y < pixels.height; ++y)
          for (int x = 0; x < pixels.width; ++x)
            grey.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(
                std::lround(255 * std::min(1.0, static_cast<double>(pixels.at(x, y)) / full)));
        return grey;
      },
      frame);
}

DepthMap empty_map(const Lens& lens) {
  return DepthMap(static_cast<std::size_t>(lens.width_px) * lens.height_px, kNone);
}

}  // namespace

DepthMap match_semi_global(const GreyView& frame, double full, const Pattern& pattern, const Calibration& calibration,
                           std::span<const CloudPoint> points) {
  const CalibratedCamera& camera = calibration.cameras[0];
  const Lens& lens = camera.lens;
  DepthMap depths = empty_map(lens);
  if (points.empty()) return depths;
  cv::Mat rotation(3, 3, CV_64F), translation(3, 1, CV_64F);
  for (int i = 0; i < 3; ++i) {
    translation.at<double>(i) = camera.projector_from_camera.translation[i];
    for (int k = 0; k < 3; ++k) rotation.at<double>(i, k) = camera.projector_from_camera.rotation(i, k);
  }
  const cv::Size size(lens.width_px, lens.height_px);
  cv::Mat turn, turn_projector, project, project_projector, to_points;
  cv::stereoRectify(matrix_of(lens), distortion_of(lens), matrix_of(calibration.projector),
                    distortion_of(calibration.projector), size, rotation, translation, turn, turn_projector, project,
                    project_projector, to_points, cv::CALIB_ZERO_DISPARITY, 0);
  const auto rectified = [&](const cv::Mat& image, const Lens& of, const cv::Mat& by, const cv::Mat& projected) {
    cv::Mat map_x, map_y, to;
    cv::initUndistortRectifyMap(matrix_of(of), distortion_of(of), by, projected, size, CV_32F, map_x, map_y);
    cv::remap(image, to, map_x, map_y, cv::INTER_LANCZOS4);
    return to;
  };
  const Grey8 drawn = draw_pattern(pattern);
  cv::Mat image(drawn.height(), drawn.width(), CV_8U);
  for (int y = 0; y < drawn.height(); ++y) std::copy_n(drawn.view().row(y), drawn.width(), image.ptr<std::uint8_t>(y));
  cv::GaussianBlur(image, image, {}, 0.6);
  // Both images at the camera's scale, its middle in the middle; the projector's is moved by the middle disparity of
  // the symbols, so that what is seen of the surface lies in both.
  const cv::Matx33d turned(turn);
  const Eigen::Vector2d ray = lens.undistort({0.5 * lens.width_px, 0.5 * lens.height_px});
  const cv::Vec3d ahead = turned * cv::Vec3d(ray.x(), ray.y(), 1);
  const double f = lens.fx, cx = 0.5 * lens.width_px - f * ahead[0] / ahead[2],
               cy = 0.5 * lens.height_px - f * ahead[1] / ahead[2];
  const double baseline_mm = project_projector.at<double>(0, 3) / project_projector.at<double>(0, 0);
  double nearest = 0, farthest = std::numeric_limits<double>::max();  // inverse depths
  for (const CloudPoint& point : points) {
    const double z = turned(2, 0) * point.x + turned(2, 1) * point.y + turned(2, 2) * point.z;
    nearest = std::max(nearest, (1 + kOfRange) / z), farthest = std::min(farthest, (1 - kOfRange) / z);
  }
  const double middle = -f * baseline_mm * 0.5 * (nearest + farthest),
               reach = std::abs(f * baseline_mm) * 0.5 * (nearest - farthest);
  const cv::Matx33d project_left(f, 0, cx, 0, f, cy, 0, 0, 1), project_right(f, 0, cx + middle, 0, f, cy, 0, 0, 1);
  const cv::Mat left = rectified(grey_of(frame, full), lens, turn, cv::Mat(project_left)),
                right = rectified(image, calibration.projector, turn_projector, cv::Mat(project_right));
  const int first = -static_cast<int>(std::ceil(reach)), count = (static_cast<int>(2 * reach) / 16 + 1) * 16;
  constexpr int kBlock = 7;
  const auto matcher = cv::StereoSGBM::create(first, count, kBlock, 8 * kBlock * kBlock, 32 * kBlock * kBlock, 1, 31, 5,
                                              100, 1, cv::StereoSGBM::MODE_SGBM);
  cv::Mat disparities;
  matcher->compute(left, right, disparities);
  // Each pixel of the camera where it lies in the rectified image.
  std::vector<cv::Point2f> pixels, places;
  for (int y = 0; y < lens.height_px; ++y)
    for (int x = 0; x < lens.width_px; ++x) pixels.emplace_back(static_cast<float>(x), static_cast<float>(y));
  cv::undistortPoints(pixels, places, matrix_of(lens), distortion_of(lens), turn, cv::Mat(project_left));
  for (std::size_t i = 0; i < places.size(); ++i) {
    const int x = static_cast<int>(std::lround(places[i].x)), y = static_cast<int>(std::lround(places[i].y));
    if (x < 0 || y < 0 || x >= disparities.cols || y >= disparities.rows) continue;
    const int sixteenths = disparities.at<std::int16_t>(y, x);
    if (sixteenths < 16 * first) continue;
    const double z = -f * baseline_mm / (middle + sixteenths / 16.0);
    const cv::Vec3d back = turned.t() * cv::Vec3d(z * (places[i].x - cx) / f, z * (places[i].y - cy) / f, z);
    depths[i] = static_cast<float>(back[2]);
  }
  return depths;
}

DepthMap join_by_triangles(const Pattern& pattern, const Calibration& calibration, std::span<const CloudPoint> points) {
  const Lens& lens = calibration.cameras[0].lens;
  DepthMap depths = empty_map(lens);
  if (points.size() < 3) return depths;
  struct Corner {
    double x, y, inverse_depth;
  };
  std::vector<Corner> corners;
  cv::Subdiv2D plane(cv::Rect(-1, -1, lens.width_px + 2, lens.height_px + 2));
  double middle_mm = 0;
  constexpr int kFirst = 4;  // of the vertices: before it come those of the frame around all
  for (const CloudPoint& point : points) {
    const int vertex = plane.insert({point.camera_u, point.camera_v});
    corners.resize(std::max<std::size_t>(corners.size(), static_cast<std::size_t>(vertex) + 1), {0, 0, 0});
    corners[vertex] = {point.camera_u, point.camera_v, 1.0 / static_cast<double>(point.z)};
    middle_mm += static_cast<double>(point.z) / static_cast<double>(points.size());
  }
  const double side_most =
      kSideMostPitches * pattern.pitch_px() *
      static_cast<double>(
          ExpectedFrames(calibration.cameras[0], calibration.projector, middle_mm).in_the_middle().scale);
  std::vector<cv::Vec6f> triangles;
  plane.getTriangleList(triangles);
  for (const cv::Vec6f& triangle : triangles) {
    std::array<Corner, 3> of;
    bool whole = true;
    for (int k = 0; k < 3 && whole; ++k) {
      int edge = 0, vertex = 0;
      const cv::Point2f at(triangle[2 * k], triangle[2 * k + 1]);
      whole = at.x >= 0 && at.y >= 0 && at.x < static_cast<float>(lens.width_px) &&
              at.y < static_cast<float>(lens.height_px) &&
              plane.locate(at, edge, vertex) == cv::Subdiv2D::PTLOC_VERTEX && vertex >= kFirst;
      if (whole) of[k] = corners[vertex];
    }
    if (!whole) continue;
    const auto side = [&](int a, int b) { return std::hypot(of[a].x - of[b].x, of[a].y - of[b].y); };
    const auto [least, most] = std::minmax({of[0].inverse_depth, of[1].inverse_depth, of[2].inverse_depth});
    if (std::max({side(0, 1), side(1, 2), side(2, 0)}) > side_most || most - least > kDepthMost * most) continue;
    const double area = (of[1].x - of[0].x) * (of[2].y - of[0].y) - (of[2].x - of[0].x) * (of[1].y - of[0].y);
    const auto [left, right] = std::minmax({of[0].x, of[1].x, of[2].x});
    const auto [top, bottom] = std::minmax({of[0].y, of[1].y, of[2].y});
    for (int y = static_cast<int>(std::ceil(top)); y <= bottom && y < lens.height_px; ++y) {
      for (int x = static_cast<int>(std::ceil(left)); x <= right && x < lens.width_px; ++x) {
        const double b = ((x - of[0].x) * (of[2].y - of[0].y) - (of[2].x - of[0].x) * (y - of[0].y)) / area,
                     c = ((of[1].x - of[0].x) * (y - of[0].y) - (x - of[0].x) * (of[1].y - of[0].y)) / area;
        if (b < 0 || c < 0 || b + c > 1) continue;
        const double inverse = (1 - b - c) * of[0].inverse_depth + b * of[1].inverse_depth + c * of[2].inverse_depth;
        depths[static_cast<std::size_t>(y) * lens.width_px + x] = static_cast<float>(1 / inverse);
      }
    }
  }
  return depths;
}

}  // namespace slsd
