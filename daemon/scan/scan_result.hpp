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
#include "core/decode/decoding.hpp"
#include "daemon/scan/cloud_files.hpp"
#include "drivers/camera/camera.hpp"
#include "drivers/camera/frame.hpp"

namespace slsd {

using StageTimes = std::array<std::chrono::nanoseconds, kStageCount>;

/// Takes the time of each stage of a decode; over several frames the times add up.
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

/// The reason for which a region gave no point.
struct RegionReason {
  float camera_u, camera_v;  ///< its centre
  std::uint8_t camera;       ///< index of the camera in the calibration
  DecodeRule rule;
  std::optional<DecodeRule> guard;  ///< the last that kept it from being brought back
};

using RegionCounts = std::array<std::uint32_t, kRegionStatusCount>;

/// The tries of a scan whose frames were lost, torn or late, before the one that it ended with.
struct LostTries {
  std::uint64_t count = 0;
  std::vector<Error> last;  ///< the newest few, oldest first
};

/// The coding of a cloud's frames that are kept beside it.
enum class FrameCoding { kNone, kRaw, kPng };

struct ScanRequest {
  MonotonicTime deadline;                   ///< end of the wait for the devices and the frames
  bool picture = false;                     ///< also draw what was decoded in the frame
  std::string camera;                       ///< the camera of the picture; empty: the first
  FrameCoding frames = FrameCoding::kNone;  ///< coding of the frames that come with the cloud
  bool texture = false;                     ///< intensities from frames in white light
  bool ambient = false;                     ///< less those in the light of the room alone
  CloudFormats formats = {};                ///< formats in which the cloud is written
  std::stop_token gone = {};                ///< requested when nobody waits for the outcome any more
  bool why = false;                         ///< the picture has each rejected region in the colour of its rule
  bool of_stream = false;                   ///< follows another: pixels where nothing moves are measured from there
};

/// One frame of one camera is asked for.
struct FrameRequest {
  MonotonicTime deadline;
  std::string camera;         ///< empty: the first
  bool as_png = true;         ///< else row by row
  bool as_shown = false;      ///< leaves the projector's picture as it is; else shows the pattern
  std::stop_token gone = {};  ///< requested when nobody waits for the outcome any more
};

/// One camera's image as it came.
struct FrameImage {
  std::string bytes;  ///< a PNG, or pixels row by row, 16 bits little-endian
  int width_px = 0;
  int height_px = 0;
  int bits = 8;
  std::uint64_t sequence = 0;
  std::string camera = {};  ///< its name; the times are those of the Frame
  Picture light = Picture::kPattern;
  MonotonicTime exposure_start = {};
  MonotonicTime received = {};
};

/// The outcome of a scan.
struct ScanResult {
  Cloud cloud;
  std::shared_ptr<const DenseCloud> dense = {};  ///< a point for each pixel, where it was asked for; shared: as large
                                                 ///< as the frames
  std::string empty = {};                        ///< why no symbol became a point, in words; empty: some did
  CloudFiles files = {};                         ///< the cloud's, in the formats that were asked for
  LostTries lost = {};
  std::vector<CloudPoint> strays;          ///< symbols that a knocked rig has elsewhere: see stray_symbols()
  RegionCounts regions{};                  ///< regions of all cameras, by status
  RuleCounts rules{};                      ///< the same by the rule that decided
  std::vector<RegionReason> reasons = {};  ///< one for each region that gave no point, of all cameras
  std::optional<std::uint64_t> saturated;  ///< points without an intensity, as white was too bright; where it was asked
                                           ///< for
  std::optional<std::uint64_t> dense_saturated = {};  ///< the same, of the points of pixels
  MonotonicTime received;                             ///< time when the last byte of its frames had arrived
  std::chrono::nanoseconds skew{};                    ///< time from the first camera's exposure to the last one's
  std::uint64_t skipped = 0;  ///< sets of frames since the scan before that were not decoded: newer ones came
  std::chrono::nanoseconds capture_time{};
  std::chrono::nanoseconds decode_time{};
  std::chrono::nanoseconds dense_time{};  ///< the part of decode_time spent on the points of pixels
  StageTimes stage_times{};
  std::vector<double> full_levels;  ///< the level of a saturated pixel, of each camera
  std::string picture_png;          ///< empty unless asked for
  std::vector<FrameImage> frames;   ///< one to a camera, in the configuration's order, those of the pattern, of
                                    ///< white, of dark; empty unless asked for
};

}  // namespace slsd
