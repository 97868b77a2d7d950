// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/code/pattern.hpp"
#include "core/decode/options.hpp"
#include "core/geometry/calibration.hpp"
#include "core/result.hpp"
#include "daemon/scan/cloud/scan_result.hpp"
#include "daemon/scan/rig/frame_set.hpp"
#include "daemon/scan/scan_setup.hpp"

namespace slsd {

/// The settings that a kept scan was decoded with.
struct KeptSettings {
  Pattern pattern;
  std::optional<Calibration> calibration;
  DecodeOptions decode;
  std::vector<std::string> camera_names;  ///< of the cameras that measure
  std::vector<std::string> camera_formats;
  CloudOptions cloud;  ///< the part of scans that ask for none
  std::optional<HandEyeCalibration> hand_eye;

  /// The configured name of a camera of the calibration.
  [[nodiscard]] const std::string& camera_name(std::size_t in_calibration) const {
    const bool by_name = calibration && calibration->cameras.size() > 1;  // a single one matches any name
    return by_name ? calibration->cameras[in_calibration].name : camera_names.front();
  }
};

/// The frames of a kept scan as raw pixels: first the pattern, then white, then dark. None of texture cameras: a replay
/// has no colours.
using KeptFrames = std::vector<FrameImage>;

// Shared below: a bundle may still be writing a scan that the box has dropped.

/// One scan with all that is known of it. A scan that ended before it had frames has none.
struct KeptScan {
  std::string id;
  std::chrono::system_clock::time_point time;         ///< time of the first such scan
  std::shared_ptr<const KeptSettings> settings;       ///< null if the scan never had its turn
  std::shared_ptr<const KeptFrames> frames;           ///< null: none, or too large to keep
  bool too_large = false;                             ///< its frames alone exceed the memory limit
  Density density = Density::kSymbols;                ///< density of the requested cloud
  CloudOptions part = {};                             ///< the part of the scene that the cloud shows
  std::optional<RigidTransform> base_from_rig = {};   ///< if the part is in the robot's base, and this is known
  std::shared_ptr<const Result<ScanResult>> outcome;  ///< null until decoded; no pictures, colours or dense points
  std::uint64_t times = 1;                            ///< number of successive failures like this one without frames
};

/// Keeps the last scans within a memory limit: their frames, the settings that decoded them, and their outcomes. A scan
/// costs one copy of its frames, into the memory of a dropped scan.
/// @thread thread-safe
class BlackBox {
 public:
  /// @param bytes_max  0: keeps nothing
  explicit BlackBox(std::size_t bytes_max) : bytes_max_(bytes_max) {}

  [[nodiscard]] std::size_t bytes_max() const { return bytes_max_; }
  /// The bytes held now.
  [[nodiscard]] std::size_t bytes() const;

  void keep_frames(const std::string& id, const FrameSet& set, const SharedSetup& setup, const ScanRequest& request);
  /// @param result  the outcome for the scan's client; unchanged after the call
  void keep_outcome(const std::string& id, const SharedSetup& setup, Result<ScanResult>& result);

  /// Oldest first.
  [[nodiscard]] std::vector<KeptScan> scans() const;

 private:
  struct Entry {
    KeptScan scan;
    std::shared_ptr<KeptFrames> frames;  // scan.frames, whose memory will be reused
    std::size_t bytes = 0;
  };
  [[nodiscard]] Entry* find(const std::string& id);
  [[nodiscard]] Entry& find_or_begin(const std::string& id, const SharedSetup& setup);
  [[nodiscard]] std::shared_ptr<const KeptSettings> settings_of(const SharedSetup& setup);
  void grow(Entry& entry, std::size_t bytes);
  void make_room(const std::string& id);

  const std::size_t bytes_max_;
  mutable std::mutex mutex_;
  std::deque<Entry> entries_;
  std::size_t bytes_ = 0;
  std::vector<std::string> spare_;  // image memory of dropped scans
  std::weak_ptr<ScanSetup> setup_;  // the setup that settings_ describes
  std::shared_ptr<const KeptSettings> settings_;
};

}  // namespace slsd
