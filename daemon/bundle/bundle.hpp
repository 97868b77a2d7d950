// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/result.hpp"
#include "daemon/scan/black_box.hpp"
#include "drivers/files/tar.hpp"

namespace slsd {

/// The version of the bundles that slsd writes and reads.
inline constexpr int kBundleVersion = 1;
/// A longer file is refused before it is read.
inline constexpr std::size_t kBundleBytesMax = std::size_t{1} << 30U;

/// The service's state, written into a bundle beside the scans.
struct BundleNotes {
  nlohmann::json reason;  ///< the failed scan and its error; null if somebody requested the bundle
  nlohmann::json status;  ///< answers to `status`, `settings` and `metrics`
  nlohmann::json settings;
  std::string metrics;
};

/// Writes a bundle: a tar archive of recordings, one for each setup that decoded the scans, as docs/formats.md
/// describes.
/// @errors of encode_png()
/// @thread reentrant
[[nodiscard]] Result<std::string> write_bundle(const std::vector<KeptScan>& scans, const BundleNotes& notes,
                                               std::chrono::system_clock::time_point now);

/// A frame of a bundle.
struct BundledFrame {
  std::string camera;
  std::string light;     ///< "pattern", "white" or "dark"
  std::string_view png;  ///< a PNG or any other format of read_image()
  std::uint64_t sequence = 0;
};

/// A scan of a bundle.
struct BundledScan {
  std::string id;
  std::string time;
  std::string error;  ///< the error's name; empty: the scan gave a cloud
  std::vector<BundledFrame> frames;
  std::vector<double> full_levels;
  bool dense = false;
  CloudOptions part;                            ///< the part of the scene that the cloud shows
  std::optional<RigidTransform> base_from_rig;  ///< if the part is in the robot's base
  std::optional<std::string_view> cloud;        ///< the PLY of the symbols
};

/// Scans that the same setup decoded.
struct BundledRecording {
  std::string name;
  std::string_view configuration, pattern, calibration;  ///< the texts of the files
  std::vector<BundledScan> scans;
};

/// A bundle as read; its views refer to the archive's bytes, which must outlive it.
struct Bundle {
  std::string version;  ///< version of the slsd that wrote the bundle
  std::string written;
  std::string reason;  ///< the error of the failed scan, or empty
  std::vector<TarFile> files;
  std::vector<BundledRecording> recordings;
};

/// Reads a bundle of any origin.
/// @errors those of read_tar(); kMalformed: a part is missing, too long, or inconsistent; kUnsupported: another version
/// @thread reentrant
[[nodiscard]] Result<Bundle> read_bundle(std::string_view archive);

}  // namespace slsd
