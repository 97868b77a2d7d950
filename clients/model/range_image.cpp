// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/range_image.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

namespace slsd::model {
namespace {

/// Farthest that a point may lie from the centre of its pixel. Floats and interpolated rays keep it within 0.01.
constexpr double kOffMostPx = 0.1;
/// Share of the points that may lie farther.
constexpr double kOffShare = 0.01;

struct Placed {
  int u, v;
  float depth_mm;
  const DensePoint* point;
};

tl::unexpected<Error> other_calibration() {
  return fail(ErrorCode::kMismatch,
              "the cloud was measured with another calibration: its points lie on no rays of the camera. Take "
              "calibration and clouds of one recording");
}

Result<std::vector<Placed>> place(std::span<const DensePoint> points, std::size_t camera,
                                  const CalibratedCamera& calibrated, const std::optional<Box>& box) {
  const RigidTransform camera_from_rig = calibrated.rig_from_camera.inverse();
  const Lens& lens = calibrated.lens;
  std::vector<Placed> placed;
  std::size_t off = 0, all = 0;
  for (const DensePoint& point : points) {
    if (point.camera != camera) continue;
    ++all;
    const Eigen::Vector3d in_camera = camera_from_rig * point.place_mm.cast<double>();
    const Eigen::Vector2d pixel = in_camera.z() > 0 ? lens.project(in_camera) : Eigen::Vector2d::Constant(-1);
    const Eigen::Vector2d whole = pixel.array().round();
    const bool inside = whole.x() >= 0 && whole.y() >= 0 && whole.x() < lens.width_px && whole.y() < lens.height_px;
    if (!inside || (pixel - whole).cwiseAbs().maxCoeff() > kOffMostPx) {
      ++off;
      continue;
    }
    if (box && !box->contains(point.place_mm)) continue;
    placed.push_back(
        {static_cast<int>(whole.x()), static_cast<int>(whole.y()), static_cast<float>(in_camera.z()), &point});
  }
  if (static_cast<double>(off) > kOffShare * static_cast<double>(all)) return other_calibration();
  return placed;
}

RangeImage crop(const std::vector<Placed>& placed, std::size_t number, const Calibration& calibration,
                const std::optional<Box>& box) {
  const CalibratedCamera& camera = calibration.cameras[number];
  RangeImage image;
  image.camera = number;
  image.lens = camera.lens;
  image.camera_from_rig = camera.rig_from_camera.inverse();
  image.projector = calibration.projector;
  image.projector_from_rig = camera.projector_from_camera.after(image.camera_from_rig);
  image.box = box;
  image.left = camera.lens.width_px, image.top = camera.lens.height_px;
  int right = 0, bottom = 0;
  for (const Placed& each : placed) {
    image.left = std::min(image.left, each.u), image.top = std::min(image.top, each.v);
    right = std::max(right, each.u), bottom = std::max(bottom, each.v);
  }
  image.width = right - image.left + 1, image.height = bottom - image.top + 1;
  const std::size_t pixels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  image.depth_mm.assign(pixels, std::numeric_limits<float>::quiet_NaN());
  image.sigma_mm.assign(pixels, std::numeric_limits<float>::quiet_NaN());
  image.intensity.assign(pixels, 0);
  if (placed.front().point->coloured) image.colours.assign(pixels, Rgb{});
  for (const Placed& each : placed) {
    const std::size_t pixel = image.index(each.u - image.left, each.v - image.top);
    image.depth_mm[pixel] = each.depth_mm;
    image.sigma_mm[pixel] = each.point->sigma_mm;
    image.intensity[pixel] = each.point->intensity;
    if (!image.colours.empty()) image.colours[pixel] = each.point->colour;
  }
  return image;
}

}  // namespace

void RangeImage::trim() {
  int first_x = width, first_y = height, last_x = -1, last_y = -1;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (std::isnan(depth_mm[index(x, y)])) continue;
      first_x = std::min(first_x, x), last_x = std::max(last_x, x);
      first_y = std::min(first_y, y), last_y = y;
    }
  }
  if (last_y < 0) first_x = first_y = 0;
  const int kept_width = last_x - first_x + 1, kept_height = last_y - first_y + 1;
  const auto keep = [&](auto& values) {
    std::remove_reference_t<decltype(values)> kept;
    kept.reserve(static_cast<std::size_t>(kept_width) * static_cast<std::size_t>(kept_height));
    for (int y = first_y; y <= last_y; ++y) {
      const auto begin = values.begin() + static_cast<std::ptrdiff_t>(index(first_x, y));
      kept.insert(kept.end(), begin, begin + kept_width);
    }
    values = std::move(kept);
  };
  keep(depth_mm), keep(sigma_mm), keep(intensity);
  if (!colours.empty()) keep(colours);
  left += first_x, top += first_y, width = kept_width, height = kept_height;
}

Result<std::vector<RangeImage>> range_images(std::span<const DensePoint> points, const Calibration& calibration,
                                             const std::optional<Box>& box) {
  std::vector<RangeImage> images;
  for (const DensePoint& point : points)
    if (point.camera >= calibration.cameras.size()) return other_calibration();
  for (std::size_t camera = 0; camera < calibration.cameras.size(); ++camera) {
    const auto placed = place(points, camera, calibration.cameras[camera], box);
    if (!placed) return tl::unexpected(placed.error());
    if (!placed->empty()) images.push_back(crop(*placed, camera, calibration, box));
  }
  return images;
}

}  // namespace slsd::model
