// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/cloud/texture_cameras.hpp"

#include <algorithm>
#include <utility>

#include "core/dense/cloud/paint_view.hpp"

namespace slsd {

Result<TextureCameras> TextureCameras::of(const FrameSet& set, const ScanSetup& setup) {
  TextureCameras textures;
  for (std::size_t i = setup.measuring_cameras(); i < setup.camera_names.size(); ++i) {
    const std::string& name = setup.camera_names[i];
    Camera camera{name, *setup.calibration->camera(name), std::make_unique<SeenLight>()};
    if (auto read = read_light(set, setup, i, true, *camera.seen); !read)
      return tl::unexpected(std::move(read.error()));
    if (camera.seen->light.white_colours == nullptr) {
      return fail(ErrorCode::kUnsupported,
                  "is only for colour (use = \"texture\"), but its frames have none: configure a colour format, such "
                  "as \"BayerRG8\" or \"YUYV\", or scan without colour",
                  "camera " + name);
    }
    const Lens& lens = camera.calibrated.lens;
    if (std::pair(camera.seen->white.width(), camera.seen->white.height()) !=
        std::pair(lens.width_px, lens.height_px)) {
      return fail(ErrorCode::kMismatch,
                  "its frames differ in size from its calibration: calibrate again, or configure that size",
                  "camera " + name);
    }
    textures.of_symbols_.emplace_back(camera.calibrated, camera.seen->light);
    textures.cameras_.push_back(std::move(camera));
  }
  return textures;
}

void TextureCameras::add(const ScanSetup& setup, std::uint8_t camera, std::span<const CloudPoint> symbols,
                         const DenseView* pixels) {
  if (empty()) return;
  const CalibratedCamera& by = setup.calibration->cameras[camera];
  const Eigen::Vector3d projector_mm = by.rig_from_camera * by.projector_from_camera.inverse().translation;
  const MeasuredSurface surface =
      surface_of(symbols, projector_mm, setup.calibration->projector, setup.pattern.pitch_px());
  for (TextureView& view : of_symbols_) view.add(surface);
  measured_by_.push_back(camera);
  if (pixels == nullptr) return;
  if (of_pixels_.empty())
    for (const Camera& each : cameras_) of_pixels_.emplace_back(each.calibrated, each.seen->light);
  const MeasuredSurface surface_of_pixels = surface_of(*pixels);
  for (TextureView& view : of_pixels_) view.add(surface_of_pixels);
}

void TextureCameras::paint(ScanResult& result) const {
  if (empty()) return;
  std::vector<std::vector<CloudPoint>> painted(cameras_.size());
  std::uint64_t unseen = 0, saturated = 0;
  for (CloudPoint& point : result.cloud.points) {
    const auto surface = static_cast<std::size_t>(std::ranges::find(measured_by_, point.camera) - measured_by_.begin());
    const std::uint8_t painter =
        slsd::paint({point.x, point.y, point.z}, point.sigma_mm, of_symbols_, surface, point.colour);
    unseen += painter == kUnseenByAll;
    saturated += painter == kSaturatedInAll && point.intensity < 255;
    if (painter < painted.size()) painted[painter].push_back(point);
  }
  result.unseen = unseen;
  result.saturated = result.saturated.value_or(0) + saturated;
  for (std::size_t i = 0; i < cameras_.size(); ++i)
    if (const auto balance = white_balance_of(painted[i], cameras_[i].seen->light.gains))
      result.white_balance.push_back({cameras_[i].name, *balance});
}

void TextureCameras::paint(std::span<DenseView> views, Executor& executor, ScanResult& result) const {
  if (empty()) return;
  Unpainted all;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Unpainted of_view = paint_view(views[i], of_pixels_, i, executor);
    all.unseen += of_view.unseen, all.saturated += of_view.saturated;
  }
  result.dense_unseen = all.unseen;
  result.dense_saturated = result.dense_saturated.value_or(0) + all.saturated;
}

}  // namespace slsd
