// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/dense_outlook.hpp"

#include <cmath>

#include <Eigen/Geometry>

#include "core/appearance/patch_map.hpp"
#include "core/appearance/pattern_field.hpp"
#include "core/decode/grid/lattice_frame.hpp"
#include "core/dense/nodes/ray_grid.hpp"
#include "core/geometry/ray_table.hpp"

namespace slsd {
namespace {

/// Width of an upright part, in windows, at which half of it is measured; its borders are pruned.
constexpr double kThinnestWindows = 1.3;
constexpr double kHalfTransferWindows = 1.3;
/// Ratio of a window to a cell below which every pattern has a window without an edge.
constexpr double kWindowOfPitchLeast = 0.45;

constexpr float kBlurPx = 0.55F;
constexpr float kDarkLevel = 20, kLightLevel = 180;

}  // namespace

DenseOutlook dense_outlook(const Pattern& pattern, const Calibration& calibration, std::size_t camera_index,
                           const DecodeOptions& decode, int window_px) {
  const CalibratedCamera& camera = calibration.cameras[camera_index];
  const double depth_mm = decode.middle_depth_mm();
  const double pitch =
      pattern.pitch_px() *
      static_cast<double>(ExpectedFrames(camera, calibration.projector, depth_mm).in_the_middle().scale);
  const double mm_per_px = depth_mm / std::sqrt(camera.lens.fx * camera.lens.fy);
  const Eigen::Vector2d middle(0.5 * camera.lens.width_px, 0.5 * camera.lens.height_px);
  const PatchMap map = make_patch_map(RayTable(camera.lens).ray(middle), middle, camera.projector_from_camera,
                                      calibration.projector, depth_mm);
  return {depth_mm,
          pitch,
          kThinnestWindows * window_px * mm_per_px,
          kHalfTransferWindows * window_px * mm_per_px,
          std::abs(map.inverse_depth_per_px) * depth_mm * depth_mm,
          window_px < kWindowOfPitchLeast * pitch};
}

Grey8 wall_frame(const Pattern& pattern, const Calibration& calibration, std::size_t camera_index, double depth_mm) {
  const CalibratedCamera& camera = calibration.cameras[camera_index];
  const Lens& projector = calibration.projector;
  const Grey8 image = draw_pattern(pattern);
  const PatternField field(image.view(), kBlurPx);
  const RayGrid rays(camera.lens);
  Grey8 frame(camera.lens.width_px, camera.lens.height_px);
  for (int y = 0; y < frame.height(); ++y) {
    for (int x = 0; x < frame.width(); ++x) {
      const Eigen::Vector3d point = depth_mm * rays.at(x, y).homogeneous().cast<double>();
      const Eigen::Vector3d seen =
          camera.projector_from_camera.rotation * point + camera.projector_from_camera.translation;
      const Eigen::Vector2d pixel = projector.distort(seen.head<2>() / seen.z());
      const float light = field.at(static_cast<float>(pixel.x()), static_cast<float>(pixel.y())).value;
      frame.at(x, y) = static_cast<std::uint8_t>(std::lround(kDarkLevel + kLightLevel * light));
    }
  }
  return frame;
}

}  // namespace slsd
