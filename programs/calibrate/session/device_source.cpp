// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/session/device_source.hpp"

#include <algorithm>
#include <chrono>

#include "daemon/scan/rig/devices.hpp"

namespace slsd {
namespace {

constexpr int kLostMax = 5;
constexpr int kTimeoutMs = 10'000;  // network cameras take seconds to open
constexpr double kLatencyMs = 200;  // covers the image processing of unmeasured projectors
constexpr int kSkewMs = 10'000;     // the board is still, so exposures need not coincide

bool only_this_frame(ErrorCode code) {
  return code == ErrorCode::kFrameDropped || code == ErrorCode::kFrameTorn || code == ErrorCode::kFrameStale ||
         code == ErrorCode::kFrameLate || code == ErrorCode::kMismatch;
}

ScanOptions patient(ScanOptions options) {
  options.timeout_ms = std::max(options.timeout_ms, kTimeoutMs);
  options.exposure_skew_ms = std::max(options.exposure_skew_ms, kSkewMs);
  options.projector_latency_ms = std::max(options.projector_latency_ms, kLatencyMs);
  return options;
}

}  // namespace

DeviceSource::DeviceSource(std::unique_ptr<Projector> projector, std::vector<std::unique_ptr<Camera>> cameras,
                           std::vector<std::string> names, const ScanOptions& options)
    : names_(std::move(names)),
      projector_{projector->description().width_px, projector->description().height_px},
      options_(options),
      shown_(projector_.width_px, projector_.height_px, 0),
      rig_(std::move(projector), std::move(cameras), shown_, options) {}

Result<std::unique_ptr<DeviceSource>> DeviceSource::create(const Configuration& configuration) {
  if (configuration.cameras.empty()) {
    return fail(ErrorCode::kNotFound,
                "no camera is configured: add a [[camera]] table, or calibrate from captures with --from");
  }
  auto projector = make_projector(configuration.projector);
  if (!projector) return tl::unexpected(projector.error());
  std::vector<std::unique_ptr<Camera>> cameras;
  std::vector<std::string> names;
  for (const CameraOptions& options : configuration.cameras) {
    auto camera = make_camera(options);
    if (!camera) return tl::unexpected(camera.error());
    cameras.push_back(std::move(*camera));
    names.push_back(options.name());
  }
  return std::unique_ptr<DeviceSource>(
      new DeviceSource(std::move(*projector), std::move(cameras), std::move(names), patient(configuration.scan)));
}

void DeviceSource::show(const Grey8& image) {
  if (shown_ == image) return;
  shown_ = image;
  rig_.show(image);
  rig_.supervise();
}

Result<std::vector<GreyImage>> DeviceSource::grab() {
  for (int lost = 0;; ++lost) {
    const auto set = rig_.capture(std::chrono::steady_clock::now() + options_.timeout());
    if (set) {
      std::vector<GreyImage> pictures;
      for (const Frame& frame : set->frames) {
        pictures.push_back(copy_of(frame.image()));
      }
      return pictures;
    }
    if (lost == kLostMax || !only_this_frame(set.error().code)) return tl::unexpected(set.error());
  }
}

}  // namespace slsd
