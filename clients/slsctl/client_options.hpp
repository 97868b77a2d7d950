// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <slsd/connection.hpp>

namespace slsd {

inline constexpr int kDone = 0;
inline constexpr int kRequestFailed = 1;
inline constexpr int kWrongUsage = 2;
inline constexpr int kNoDaemon = 3;

/// slsctl's command line. Files to write are "-" for standard output.
struct ClientOptions {
  std::filesystem::path socket = client::default_socket();
  bool json = false;
  std::filesystem::path output;   ///< scan: the cloud; metrics, bundle: the file; empty: none
  std::string format;             ///< scan: the cloud's format, as of cloud_format(); empty: from the file's name
  std::string metrics_format;     ///< metrics: "openmetrics" or "prometheus"; empty: depends on the destination
  std::filesystem::path picture;  ///< scan: the frame with the decoded symbols; light: the frame with its light
  std::vector<std::filesystem::path> from;  ///< light: one or two frames to read; empty: from the service
  bool why = false;                         ///< scan: the picture shows the rule that rejected each region
  std::filesystem::path cloud_picture;      ///< scan: the cloud, drawn
  std::filesystem::path image;              ///< preview, frame, pattern: the PNG to write
  std::filesystem::path shown;              ///< project: a picture's name, or a file
  std::string density;                      ///< scan, watch, record: "symbols" or "pixels"; empty: as configured
  std::string coordinate_frame;             ///< scan: "rig" or "robot_base"; empty: as configured
  std::vector<double> robot_pose;           ///< scan: the robot's numbers; empty: none
  std::string pose_notation;                ///< scan: how the robot writes them
  std::vector<double> box;                  ///< scan, record: corners of the part to measure, mm; empty: as configured
  std::string box_frame;                    ///< scan, record: "rig" or "robot_base"; empty: as configured
  bool set = false;                         ///< plane: subtract it from now on
  std::optional<double> margin_mm;          ///< plane: drop points up to this far before it
  std::optional<double> voxel_mm;           ///< scan, record
  std::optional<int> stride;                ///< scan, record
  bool normals = false;                     ///< scan, record: normals of pixels
  bool mesh = false;                        ///< scan: triangles of pixels
  bool colour = false;                      ///< scan: colours from a frame in white light
  bool texture = false;                     ///< scan: intensities from a frame in white light
  bool ambient = false;                     ///< scan: minus the room's light
  bool as_shown = false;                    ///< frame: keep the projector's picture
  std::filesystem::path folder;             ///< record: the destination
  bool clouds = false;                      ///< record: the clouds too
  std::optional<double> seconds;            ///< record: ends after this time
  std::string camera;                       ///< exposure, light, frame, preview, scan: its name; empty: the first
  std::optional<double> exposure_max_us;    ///< exposure: the longest to propose
  std::optional<double> gain_max_db;        ///< exposure: the highest to propose
  std::optional<int> timeout_ms;
  std::vector<std::string> assignments;  ///< set: "decode.density=pixels"
  std::string action = "begin";          ///< calibrate: this, or "look", "end" or "cancel"; preset: "use" and others
  std::string preset;                    ///< scan, record, preset: its name
  std::string board, ruler, code;        ///< calibrate: as for slsd --calibrate; empty: its defaults
  std::optional<int> poses;              ///< calibrate
  bool resume = false;                   ///< calibrate: continue with the last session's pictures
  double interval_s = 1.0;               ///< top: between two refreshes
  std::optional<double> rate_hz;         ///< watch
  std::uint64_t count = 0;  ///< ends after this many clouds (watch), scans (record) or refreshes (top); 0: no limit
};

}  // namespace slsd
