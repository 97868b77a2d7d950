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
  std::filesystem::path output;           ///< scan: the cloud; metrics, bundle: the file; empty: none
  std::string format;                     ///< scan: the cloud's, "ply", "pcd" or "tiff"; empty: as its name ends
  std::string metrics_format;             ///< metrics: "openmetrics" or "prometheus"; empty: by where it goes
  std::filesystem::path picture;          ///< scan: the frame with what was decoded
  bool why = false;                       ///< scan: the picture says by which rule each region was rejected
  std::filesystem::path cloud_picture;    ///< scan: the cloud, drawn
  std::filesystem::path image;            ///< preview, frame, pattern: the PNG to write
  std::filesystem::path shown;            ///< project: a picture's name, or a file
  std::string density;                    ///< scan, watch: "symbols" or "pixels"; empty: as configured
  bool normals = false;                   ///< scan: normals of pixels
  bool texture = false;                   ///< scan: intensities from a frame in white light
  bool ambient = false;                   ///< scan: less the light of the room
  bool as_shown = false;                  ///< frame: whatever the projector shows
  std::filesystem::path folder;           ///< record: where to
  bool clouds = false;                    ///< record: the clouds too
  std::optional<double> seconds;          ///< record: ends after so long
  std::string camera;                     ///< exposure, frame, preview, scan: its name; empty: the first
  std::optional<double> exposure_max_us;  ///< exposure: the longest that is proposed
  std::optional<double> gain_max_db;      ///< exposure: the highest that is proposed
  std::optional<int> timeout_ms;
  std::vector<std::string> assignments;  ///< set: "decode.density=pixels"
  std::string action = "begin";          ///< calibrate: or "look", "end" or "cancel"
  std::string board, ruler, code;        ///< calibrate: as slsd --calibrate has them; empty: its own
  std::optional<int> poses;              ///< calibrate
  bool resume = false;                   ///< calibrate: the pictures of the last session count
  double interval_s = 1.0;               ///< top: between two looks
  std::optional<double> rate_hz;         ///< watch
  std::uint64_t count = 0;               ///< watch: clouds, record: scans, top: looks, after which it ends; 0: none
};

}  // namespace slsd
