// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/cloud/texture_view.hpp"
#include "core/dense/cloud/dense_cloud.hpp"
#include "core/executor.hpp"
#include "core/result.hpp"
#include "daemon/scan/cloud/scan_result.hpp"
#include "daemon/scan/cloud/seen_light.hpp"
#include "daemon/scan/rig/frame_set.hpp"
#include "daemon/scan/scan_setup.hpp"

namespace slsd {

/// The cameras that serve for colour alone, in one scan: they paint the points that others measured.
/// @thread thread-bound
class TextureCameras {
 public:
  /// None: points keep the colours of the cameras that measured them.
  TextureCameras() = default;
  /// @param set  with white frames of the setup's texture cameras
  /// @errors kUnsupported: frames without colours; of read_light()
  [[nodiscard]] static Result<TextureCameras> of(const FrameSet& set, const ScanSetup& setup);

  [[nodiscard]] bool empty() const { return cameras_.empty(); }
  /// Adds what one camera measured, before any part of it is left out: it may hide other points.
  /// @param camera  its index in the calibration
  /// @param pixels  null without a dense cloud
  void add(const ScanSetup& setup, std::uint8_t camera, std::span<const CloudPoint> symbols, const DenseView* pixels);
  /// Paints the symbols of the cloud. Counts those of unknown colour, and measures the white balance of each camera.
  void paint(ScanResult& result) const;
  /// Paints the pixels of all views, which are in the order of add(). Counts those of unknown colour.
  void paint(std::span<DenseView> views, Executor& executor, ScanResult& result) const;

 private:
  struct Camera {
    std::string name;
    CalibratedCamera calibrated;
    std::unique_ptr<SeenLight> seen;  // the views refer to it
  };
  std::vector<Camera> cameras_;
  std::vector<TextureView> of_symbols_, of_pixels_;  // by camera
  std::vector<std::uint8_t> measured_by_;            // by surface: the camera's index in the calibration
};

}  // namespace slsd
