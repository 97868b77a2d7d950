// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/code/pattern.hpp"
#include "core/decode/decoder.hpp"
#include "core/dense/dense_cloud.hpp"
#include "core/dense/dense_mapper.hpp"
#include "core/geometry/calibration.hpp"
#include "core/image.hpp"
#include "core/result.hpp"
#include "daemon/configuration/configuration.hpp"
#include "daemon/scan/crew.hpp"
#include "daemon/scan/empty_cloud.hpp"
#include "daemon/scan/scan_result.hpp"

namespace slsd {

/// The pattern that the configuration asks for: made anew, or read from its file.
/// @errors of make_pattern(), read_file() and read_pattern(); kMismatch: not of the projector's size
[[nodiscard]] Result<Pattern> configured_pattern(const Configuration& configuration);

/// Camera px for one projector px, of the calibrated camera that sees the pattern smallest; of the paper's rig without
/// a calibration.
[[nodiscard]] double pattern_scale(const std::optional<Calibration>& calibration, const DecodeOptions& options);

/// Warnings about the pattern's choice of symbols at a scale, one sentence each. Empty if there is no risk. Takes a
/// part of a second of computing.
[[nodiscard]] std::vector<std::string> symbol_warnings(const PatternOptions& pattern, double scale);

/// The calibration that the configuration names; empty where it names none.
/// @errors of read_file() and read_calibration(); kMismatch: not of this projector's size, or without one of the
/// cameras
[[nodiscard]] Result<std::optional<Calibration>> configured_calibration(const Configuration& configuration);

/// The files that a scan's cloud depends on besides its frames, as text that can be read again.
struct ScanFiles {
  std::string pattern;      ///< a pattern file
  std::string calibration;  ///< a calibration file; empty: none
};

/// Warnings about the effect of the calibration's own error, as its report has it, on dense clouds. Each tells what to
/// do. Empty if the error is unknown or small beside what the clouds measure.
[[nodiscard]] std::vector<std::string> calibration_error_warnings(const Calibration& calibration);

/// The levels of saturated pixels that the cameras' frames have shown: where no format says, a faint frame after a
/// bright one is not of fewer bits.
/// @thread thread-safe: lanes share it
class FullLevels {
 public:
  /// The greatest level that was told of this camera.
  [[nodiscard]] double raise(std::size_t camera, double level);

 private:
  std::mutex mutex_;
  std::vector<double> greatest_;
};

/// The mappers that measure a point for each pixel. They are made on the first request, as they take more memory than
/// all else.
/// @thread thread-safe; what it lends belongs to the lane's thread
class DenseMappers {
 public:
  /// Ends the stream that nobody wants any more: gives back what was kept of its frames, and maps that wait.
  void end_stream();
  /// A cloud whose maps come back, for the next ones, when nobody holds it any more: new ones would be tens of
  /// megabytes that the kernel has to fill with zeros.
  [[nodiscard]] std::shared_ptr<DenseCloud> cloud();
  /// A map that came back; an empty one where none has.
  [[nodiscard]] DenseMap spare_map();
  /// The mapper of a lane for the camera of a decoder.
  [[nodiscard]] DenseMapper& of(std::size_t lane, std::size_t camera, const Decoder& decoder, const Pattern& pattern,
                                const Calibration& calibration, const DecodeOptions& options);

 private:
  std::mutex mutex_;
  struct Spare {
    std::mutex mutex;
    std::vector<DenseMap> maps;
  };
  std::shared_ptr<Spare> spare_ = std::make_shared<Spare>();  // shared: clouds may outlive a reload
  std::map<std::pair<std::size_t, std::size_t>, std::unique_ptr<DenseMapper>> mappers_;  // by camera, lane
};

/// Everything about a scan that a reload replaces at once.
/// @thread a lane belongs to one thread at a time; the rest does not change, but for the full levels
struct ScanSetup {
  Pattern pattern;
  Grey8 image;  ///< the projector's picture of the pattern
  std::optional<Calibration> calibration;
  std::vector<std::string> camera_names;    ///< names of the configured cameras
  std::vector<std::vector<Decoder>> lanes;  ///< by decoding thread, then by configured camera; none without calibration
  OtherHardware other_hardware = OtherHardware::kError;
  std::vector<std::string> camera_formats = {};  ///< configured formats, such as "Mono12"; empty texts if left open
  std::unique_ptr<FullLevels> full_levels = std::make_unique<FullLevels>();
  DecodeOptions decode = {};
  std::unique_ptr<DenseMappers> dense = std::make_unique<DenseMappers>();
  std::unique_ptr<Crew> crew = std::make_unique<Crew>(Crew::helpers_here());  ///< helps the lanes
  std::unique_ptr<EmptyClouds> empty_clouds = std::make_unique<EmptyClouds>();
  std::vector<std::string> doubts = {};                ///< about the calibration, as calibration_doubts() has them
  double depth_min_mm = DecodeOptions{}.depth_min_mm;  ///< nearest depth of the scene, along the cameras' axes
  double depth_max_mm = DecodeOptions{}.depth_max_mm;

  /// @param lanes  how many threads decode
  /// @errors of the two above; of Decoder::create()
  [[nodiscard]] static Result<ScanSetup> create(const Configuration& configuration, std::size_t lanes);

  /// The same of a pattern and a calibration that are there already. @errors kMismatch; of Decoder::create()
  [[nodiscard]] static Result<ScanSetup> of(Pattern pattern, std::optional<Calibration> calibration,
                                            const Configuration& configuration, std::size_t lanes);

  /// Checks that a scan is possible. @errors kNotFound: no calibration, or no camera of the name
  [[nodiscard]] Result<> check(const ScanRequest& request) const;
  /// @errors kNotFound: no camera of the name
  [[nodiscard]] Result<> check_camera(const std::string& name) const;
  /// @param name  of a camera; empty: the first
  /// @return the number of cameras where there is none of the name
  [[nodiscard]] std::size_t camera_index(const std::string& name) const;

  [[nodiscard]] ScanFiles files() const;
};

// The decoders of the scans under way; shared, as a reload may replace them meanwhile.
using SharedSetup = std::shared_ptr<ScanSetup>;

}  // namespace slsd
