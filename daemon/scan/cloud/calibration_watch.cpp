// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/cloud/calibration_watch.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

#include "daemon/scan/message_ids.hpp"
#include "drivers/log/log_field.hpp"

namespace slsd {
namespace {

void log_change(DriftWatch::Change change, const std::string& camera, const DriftState& state) {
  if (change == DriftWatch::Change::kFineAgain) {
    const MessageId id(MessageId::kCalibratedAgain);
    return spdlog::info("camera {}: points lie on their epipolar lines again, {:.2f} px off", camera,
                        state.epipolar_px);
  }
  if (change == DriftWatch::Change::kNone) return;
  const MessageId id(MessageId::kKnocked);
  spdlog::warn(
      "camera {}: knocked out of its calibration since scan {}: points lie {:.2f} px off their epipolar lines, {:.2f} "
      "px are fine; {}",
      camera, *state.off_since_scan, state.epipolar_px, state.limit_px, kKnockRemedy);
}

}  // namespace

void CalibrationWatch::begin(const SharedSetup& setup) {
  setup_ = setup;
  cameras_.clear();
  const Calibration& calibration = *setup->calibration;
  for (std::size_t i = 0; i < setup->measuring_cameras(); ++i) {
    const std::string& name = setup->camera_names[i];
    const CalibratedCamera* const camera = calibration.camera(name);
    if (camera == nullptr) continue;
    cameras_.push_back({name, static_cast<std::uint8_t>(camera - calibration.cameras.data()),
                        DriftWatch(*camera, calibration.projector, calibration.report.epipolar_error_px)});
  }
}

void CalibrationWatch::note(const SharedSetup& setup, const ScanResult& result, std::uint64_t scan) {
  if (!setup->calibration) return;
  const std::lock_guard lock(mutex_);
  if (setup_.lock() != setup) begin(setup);
  for (Watched& camera : cameras_) {
    const bool stray = std::ranges::find(result.strays, camera.index, &CloudPoint::camera) != result.strays.end();
    const std::vector<CloudPoint>& points = stray ? result.strays : result.cloud.points;
    const LogField about("SLSD_CAMERA", camera.name);
    log_change(camera.watch.note(points, camera.index, scan), camera.name, camera.watch.state());
  }
}

std::vector<DriftState> CalibrationWatch::states() const {
  const std::lock_guard lock(mutex_);
  std::vector<DriftState> states;
  for (const Watched& camera : cameras_) states.push_back(camera.watch.state());
  return states;
}

}  // namespace slsd
