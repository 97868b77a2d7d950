// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/cloud/cloud.hpp"
#include "core/colour.hpp"
#include "core/decode/decoding.hpp"
#include "daemon/configuration/cloud_options.hpp"
#include "daemon/scan/cloud/cloud_files.hpp"
#include "drivers/camera/camera.hpp"
#include "drivers/camera/frame.hpp"
#include "drivers/camera/frame_image.hpp"

namespace slsd {

using StageTimes = std::array<std::chrono::nanoseconds, kStageCount>;

/// Measures the time of each stage of a decode. Adds the times of several frames.
/// @thread thread-bound
class StageClock final : public StageObserver {
 public:
  void start() { last_ = std::chrono::steady_clock::now(); }

  void stage_done(Stage stage) override {
    const auto now = std::chrono::steady_clock::now();
    times_[static_cast<std::size_t>(stage)] += now - last_;
    last_ = now;
  }

  [[nodiscard]] const StageTimes& times() const { return times_; }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  StageTimes times_{};
};

/// The reason why a region gave no point.
struct RegionReason {
  float camera_u, camera_v;  ///< the region's centre
  std::uint8_t camera;       ///< index of the camera in the calibration
  DecodeRule rule;
  std::optional<DecodeRule> guard;  ///< the last guard that kept the region from being restored
};

/// The failed tries before a scan's last one: their frames were lost, torn or late.
struct LostTries {
  std::uint64_t count = 0;
  std::vector<Error> last;  ///< the newest few, oldest first
};

/// The outcome for a camera that takes two exposures.
struct MergedCamera {
  std::string name;
  std::string problem;  ///< why its scan uses the shorter exposure alone; empty: both are merged
};

/// The light in a camera's frame under the pattern.
struct CameraLight {
  std::string name;
  SymbolLight light;
};

/// A camera's white balance as a scan found it.
struct CameraWhiteBalance {
  std::string name;
  ColourGains gains;  ///< factors that make the mean of the points grey; that of green is 1
};

struct ScanRequest {
  MonotonicTime deadline;                   ///< end of the wait for devices and frames
  bool picture = false;                     ///< also draw the decoded symbols in the frame
  std::string camera;                       ///< the camera of the picture; empty: the first
  FrameCoding frames = FrameCoding::kNone;  ///< coding of the frames that come with the cloud
  bool texture = false;                     ///< intensities from frames in white light
  bool colour = false;                      ///< colours too, from frames in white light; needs texture
  bool ambient = false;                     ///< minus the intensities under the room's light alone
  CloudFormats formats = {};                ///< formats for the cloud's files
  std::stop_token gone = {};                ///< requested when nobody waits for the outcome any more
  bool why = false;                         ///< the picture shows each rejected region in the colour of its rule
  std::optional<RigidTransform> base_from_flange = {};  ///< the robot's pose at the exposure, if it is known
  std::optional<CloudOptions> part = {};                ///< empty: as configured
  bool of_stream = false;  ///< one of a stream: pixels that do not move reuse earlier measurements
};

/// A request for one frame of one camera.
struct FrameRequest {
  MonotonicTime deadline;
  std::string camera;         ///< empty: the first
  bool as_png = true;         ///< else raw, row by row
  bool as_shown = false;      ///< keep the projector's picture; else show the pattern
  std::stop_token gone = {};  ///< requested when nobody waits for the outcome any more
};

/// The outcome of a scan.
struct ScanResult {
  Cloud cloud;
  std::shared_ptr<const DenseCloud> dense = {};        ///< a point per pixel, if requested; shared, as it is large
  std::string empty = {};                              ///< why no symbol became a point, in words; empty: some did
  CloudFiles files = {};                               ///< the cloud in the requested formats
  std::optional<RigidTransform> flange_from_rig = {};  ///< if the scanner is on the robot's arm, and this holds
  LostTries lost = {};
  std::vector<MergedCamera> merged = {};               ///< one for each camera that takes two exposures
  std::vector<CameraLight> light = {};                 ///< one for each camera; none if a white frame was divided out
  std::vector<CameraWhiteBalance> white_balance = {};  ///< one for each camera whose points have colours, if requested
  std::vector<CloudPoint> strays;                     ///< symbols that a knocked rig has displaced: see stray_symbols()
  RegionCounts regions{};                             ///< regions of all cameras, by status
  RuleCounts rules{};                                 ///< the same regions, by the rule that decided
  std::vector<RegionReason> reasons = {};             ///< one for each region that gave no point, of all cameras
  std::optional<std::uint64_t> saturated;             ///< if requested: points that white was too bright for
  std::optional<std::uint64_t> dense_saturated = {};  ///< the same for the points of pixels
  std::optional<std::uint64_t> unseen = {};           ///< with texture cameras: points that none of them sees
  std::optional<std::uint64_t> dense_unseen = {};
  std::chrono::system_clock::time_point exposed{};  ///< when the exposure began, as `cloud.time`
  MonotonicTime received;                           ///< time when the last byte of the frames arrived
  std::chrono::nanoseconds skew{};                  ///< time between the first and the last camera's exposure
  std::uint64_t skipped = 0;  ///< sets of frames since the previous scan that were skipped for newer ones
  std::chrono::nanoseconds capture_time{};
  std::chrono::nanoseconds decode_time{};
  std::chrono::nanoseconds dense_time{};  ///< the part of decode_time spent on the points of pixels
  StageTimes stage_times{};
  std::vector<double> full_levels;  ///< level of a saturated pixel in each camera
  std::string picture_png;          ///< empty unless asked for
  std::vector<FrameImage> frames;   ///< if requested: each camera under pattern, then white, then dark
};

}  // namespace slsd
