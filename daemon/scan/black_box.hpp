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
#include "daemon/scan/frame_set.hpp"
#include "daemon/scan/scan_result.hpp"
#include "daemon/scan/scan_setup.hpp"

namespace slsd {

/// The settings that a kept scan was decoded with.
struct KeptSettings {
  Pattern pattern;
  std::optional<Calibration> calibration;
  DecodeOptions decode;
  std::vector<std::string> camera_names;
  std::vector<std::string> camera_formats;
};

/// The frames of a kept scan, as raw pixels: those of the pattern, of white, of dark.
using KeptFrames = std::vector<FrameImage>;

// Shared below: the box lets go of a scan while a bundle of it is still being written.

/// One scan, as far as it is known: one that ended before it had frames has none.
struct KeptScan {
  std::string id;
  std::chrono::system_clock::time_point time;         ///< time of the first such scan
  std::shared_ptr<const KeptSettings> settings;       ///< null where it had no turn
  std::shared_ptr<const KeptFrames> frames;           ///< null: none, or too large
  bool too_large = false;                             ///< its frames alone are more than may be kept
  Density density = Density::kSymbols;                ///< the requested cloud's
  std::shared_ptr<const Result<ScanResult>> outcome;  ///< null while it is decoded; without pictures and dense points
  std::uint64_t times = 1;                            ///< such failures without frames, one after the other
};

/// The last scans: their frames, what they were decoded by, and what came of them, in so many bytes. What a scan costs
/// is a copy of its frames into memory that an older one had.
/// @thread thread-safe
class BlackBox {
 public:
  /// @param bytes_max  0: keeps nothing
  explicit BlackBox(std::size_t bytes_max) : bytes_max_(bytes_max) {}

  [[nodiscard]] std::size_t bytes_max() const { return bytes_max_; }
  /// The bytes held now.
  [[nodiscard]] std::size_t bytes() const;

  void keep_frames(const std::string& id, const FrameSet& set, const SharedSetup& setup, Density density);
  /// @param result  what the scan's client gets; the same afterwards
  void keep_outcome(const std::string& id, const SharedSetup& setup, Result<ScanResult>& result);

  /// Oldest first.
  [[nodiscard]] std::vector<KeptScan> scans() const;

 private:
  struct Entry {
    KeptScan scan;
    std::shared_ptr<KeptFrames> frames;  // scan.frames, to be used again
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
  std::vector<std::string> spare_;  // memory of frames that went
  std::weak_ptr<ScanSetup> setup_;  // that settings_ were taken from
  std::shared_ptr<const KeptSettings> settings_;
};

}  // namespace slsd
