// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/calibration_file/hand_eye_file.hpp"
#include "core/code/pattern.hpp"
#include "core/decode/decoder.hpp"
#include "core/dense/cloud/dense_cloud.hpp"
#include "core/dense/dense_mapper.hpp"
#include "core/geometry/calibration.hpp"
#include "core/image.hpp"
#include "core/result.hpp"
#include "daemon/configuration/configuration.hpp"
#include "daemon/scan/cloud/empty_cloud.hpp"
#include "daemon/scan/cloud/scan_result.hpp"
#include "drivers/system/crew.hpp"

namespace slsd {

/// The pattern that the configuration asks for: generated, or read from its file.
/// @errors of make_pattern(), read_file() and read_pattern(); kMismatch: not in the projector's size
[[nodiscard]] Result<Pattern> configured_pattern(const Configuration& configuration);

/// The calibration that the configuration names; empty if it names none.
/// @errors of read_file() and read_calibration(); kMismatch: for another projector size, or without one of the cameras
[[nodiscard]] Result<std::optional<Calibration>> configured_calibration(const Configuration& configuration);

/// The hand-eye calibration that the configuration names; empty if it names none.
/// @errors of read_file() and read_hand_eye()
[[nodiscard]] Result<std::optional<HandEyeCalibration>> configured_hand_eye(const Configuration& configuration);

/// The files that determine a scan's cloud together with its frames, as text that can be read again.
struct ScanFiles {
  std::string pattern;      ///< a pattern file
  std::string calibration;  ///< a calibration file; empty: none
  std::string hand_eye;     ///< a hand-eye file; empty: none
};

/// The saturation levels that the cameras' frames have shown so far. If no format gives the bit depth, a faint frame
/// after a bright one must not seem to have fewer bits.
/// @thread thread-safe: lanes share it
class FullLevels {
 public:
  /// Raises the camera's level if this one is higher. Returns the highest so far.
  [[nodiscard]] double raise(std::size_t camera, double level);

 private:
  std::mutex mutex_;
  std::vector<double> greatest_;
};

/// The mappers that measure a point for each pixel. They are made on the first request, because they take more memory
/// than everything else.
/// @thread thread-safe; what it lends belongs to the lane's thread
class DenseMappers {
 public:
  /// Ends the stream when nobody wants it any more. Frees what was kept of its frames, and spare maps.
  void end_stream();
  /// Frees a lane's mappers, which stopped in the middle of a frame. The next request makes new ones.
  void drop(std::size_t lane);
  /// A cloud that reuses the maps of clouds that nobody holds any more. New maps would be tens of megabytes that the
  /// kernel must fill with zeros.
  [[nodiscard]] std::shared_ptr<DenseCloud> cloud();
  /// A map that came back; an empty one if there is none.
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
/// @thread a lane belongs to one thread at a time; the rest is constant, except the full levels
struct ScanSetup {
  Pattern pattern;
  Grey8 image;  ///< the projector's picture of the pattern
  std::optional<Calibration> calibration;
  std::vector<std::string> camera_names;    ///< names of the configured cameras; those of texture cameras last
  std::vector<std::vector<Decoder>> lanes;  ///< by decoding thread, then by measuring camera; none without calibration
  OtherHardware other_hardware = OtherHardware::kError;
  std::vector<ColourGains> colour_gains = {};    ///< of the configured cameras; none: 1
  std::vector<std::string> camera_formats = {};  ///< configured formats, such as "Mono12"; an empty text if not set
  std::unique_ptr<FullLevels> full_levels = std::make_unique<FullLevels>();
  DecodeOptions decode = {};
  CloudOptions cloud = {};  ///< unless a request asks for another part
  std::unique_ptr<DenseMappers> dense = std::make_unique<DenseMappers>();
  std::unique_ptr<Crew> crew = std::make_unique<Crew>(Crew::helpers_here());  ///< helps the lanes
  std::unique_ptr<EmptyClouds> empty_clouds = std::make_unique<EmptyClouds>();
  std::vector<std::string> doubts = {};                ///< doubts about the calibration, from calibration_doubts()
  double depth_min_mm = DecodeOptions{}.depth_min_mm;  ///< nearest depth of the scene along the cameras' axes
  double depth_max_mm = DecodeOptions{}.depth_max_mm;
  std::optional<HandEyeCalibration> hand_eye = {};
  std::size_t texture_cameras = 0;  ///< how many of the cameras serve for colour alone

  /// @param lanes    number of decoding threads
  /// @param earlier  makes this one sooner if the pattern's symbols and the calibration stay; may be at work, or null
  /// @errors of the two above; of Decoder::create()
  [[nodiscard]] static Result<ScanSetup> create(const Configuration& configuration, std::size_t lanes,
                                                const ScanSetup* earlier = nullptr);

  /// Makes a setup from an existing pattern and calibration. @errors kMismatch; of Decoder::create()
  [[nodiscard]] static Result<ScanSetup> of(Pattern pattern, std::optional<Calibration> calibration,
                                            const Configuration& configuration, std::size_t lanes,
                                            const ScanSetup* earlier = nullptr);

  /// Checks that a scan is possible. @errors kNotFound: no calibration, or no camera of this name;
  ///         kInvalidArgument: a texture camera, which gives no picture of points; errors of part_of()
  [[nodiscard]] Result<> check(const ScanRequest& request) const;
  /// Checks that clouds can be in the robot's base. @errors kNotFound: no hand-eye calibration; kMismatch: it was
  /// measured with another calibration of the scanner
  [[nodiscard]] Result<> check_robot_base() const;
  /// The place of the rig in the robot's base; nothing if check_robot_base() fails, or the pose is needed but missing.
  /// @param base_from_flange  the robot's pose; counts if the scanner is on its arm
  [[nodiscard]] std::optional<RigidTransform> base_from_rig(
      const std::optional<RigidTransform>& base_from_flange) const;
  /// The part of the cloud that a request asks for, in the rig's frame.
  /// @errors of check_robot_base(); kInvalidArgument: a box that no camera sees, or in the robot's base without its
  /// pose
  [[nodiscard]] Result<CloudPart> part_of(const ScanRequest& request) const;
  /// Number of the first cameras that measure points.
  [[nodiscard]] std::size_t measuring_cameras() const { return camera_names.size() - texture_cameras; }
  /// @errors kNotFound: no camera of this name
  [[nodiscard]] Result<> check_camera(const std::string& name) const;
  /// @param name  of a camera; empty: the first
  /// @return the camera's index; the number of cameras if none has this name
  [[nodiscard]] std::size_t camera_index(const std::string& name) const;

  /// The level of a saturated pixel of a camera, from its format, these frames and all before. @thread thread-safe
  [[nodiscard]] double full_level_of(std::size_t camera, std::span<const GreyView> frames) const;

  [[nodiscard]] ScanFiles files() const;

 private:
  // The part, if a camera sees its box.
  [[nodiscard]] Result<CloudPart> seen_part(const CloudOptions& wanted, const RigidTransform& frame_from_rig) const;
};

// The setup of the scans under way; shared, because a reload may replace it meanwhile.
using SharedSetup = std::shared_ptr<ScanSetup>;

}  // namespace slsd
