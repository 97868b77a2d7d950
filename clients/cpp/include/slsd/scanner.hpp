// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "slsd/cloud.hpp"
#include "slsd/connection.hpp"
#include "slsd/errors.hpp"

namespace slsd::client {

struct ScanOptions {
  std::chrono::milliseconds timeout{5000};  ///< limit for devices and frames
  std::string density;                      ///< "symbols" or "pixels"; empty: as configured
  bool normals = false;                     ///< normals for the points of pixels
  bool colour = false;                      ///< the colour of each point, from a second frame in white light
  bool texture = false;                     ///< the intensity of each point, from a second frame in white light
  bool ambient = false;                     ///< minus the room's light, from a third frame
  bool picture = false;                     ///< the frame with the decoded symbols drawn in
  bool frames = false;                      ///< the frames themselves
  bool why = false;  ///< list the rules that rejected regions, in `reasons` of the description; the picture marks each
                     ///< region by its rule
  std::string preset;              ///< puts its settings into force, where they stay, and scans with them; empty: none
  std::string coordinate_frame;    ///< "rig" or "robot_base"; empty: as configured
  std::vector<double> robot_pose;  ///< the pose of the robot whose arm carries the scanner, in its own numbers
  std::string poses;               ///< how the robot writes them: "ur", "kuka", ...; with robot_pose
  /// Measures only within this box: x, y and z of its least corner, then of its greatest, mm. Empty: as configured,
  /// here and below.
  std::vector<double> box;
  /// Drops what lies on this plane or behind it: x, y and z of its unit normal, and its offset along it, mm.
  std::vector<double> plane;
  std::string box_frame;           ///< of box and plane: "rig" or "robot_base"
  std::optional<double> voxel_mm;  ///< keeps only the most certain point in each cube with this side
  std::optional<int> stride;       ///< keeps the pixels of every Nth row and column; needs density "pixels"
};

struct StreamOptions {
  std::optional<double> rate_hz;  ///< maximum rate; empty: every frame
  std::string density;            ///< see ScanOptions
  bool normals = false;           ///< normals for the points of pixels
  bool shared = false;            ///< shared memory without a copy; while two clouds are held, new ones are lost
  std::optional<std::chrono::milliseconds> idle;  ///< next() throws TimedOut if no cloud arrives for this long
};

/// A stream of clouds, the newest first, over a separate connection. In a forked child it continues over a new
/// connection.
/// @thread thread-bound
class Stream {
 public:
  /// Waits for the next cloud; `lost` counts those that came while this client read too slowly. Skips repeated scans.
  /// @throws as Connection, and the service's refusals
  [[nodiscard]] Cloud next();

  class Iterator {
   public:
    explicit Iterator(Stream* stream) : stream_(stream) {}
    Cloud operator*() const { return stream_->next(); }
    Iterator& operator++() { return *this; }
    bool operator!=(const Iterator&) const { return true; }

   private:
    Stream* stream_;
  };
  /// The start of `for (const Cloud& cloud : stream)`; `break` or an exception of next() ends it.
  [[nodiscard]] Iterator begin() { return Iterator(this); }
  [[nodiscard]] Iterator end() { return Iterator(this); }

 private:
  friend class Scanner;
  Stream(std::string socket, const StreamOptions& options);
  void subscribe();

  std::string socket_;
  std::string params_;
  Connection connection_;
  std::optional<std::chrono::milliseconds> idle_;
  std::int64_t id_ = 0;
  bool answered_ = false;
};

/// A scanner that slsd serves. Requests are answered one at a time. If the connection breaks, the pending request
/// throws ConnectionLost, and the next request connects again. After a fork, parent and child have separate
/// connections. Every method throws ScannerError's classes.
/// @thread thread-safe
class Scanner {
 public:
  /// @param socket  the service's; empty: SLSD_SOCKET in the environment, or the usual place
  /// @throws NoService, PermissionDenied
  explicit Scanner(std::string socket = {});
  ~Scanner();
  Scanner(Scanner&&) noexcept;
  Scanner& operator=(Scanner&&) noexcept;

  /// Takes one scan. The points are in memory shared with the service, without a copy.
  [[nodiscard]] Cloud scan(const ScanOptions& options = {});
  [[nodiscard]] Stream stream(const StreamOptions& options = {}) const;

  /// A camera's frame under the pattern; with `as_shown`, under the projector's current picture.
  /// @param camera  its name; empty: the first
  [[nodiscard]] Frame frame(const std::string& camera = {}, bool as_shown = false,
                            std::chrono::milliseconds timeout = std::chrono::seconds(5));
  /// A frame with the decoded symbols drawn in, as PNG.
  [[nodiscard]] Bytes preview(const std::string& camera = {},
                              std::chrono::milliseconds timeout = std::chrono::seconds(5));
  /// The pattern's image, as PNG.
  [[nodiscard]] Bytes pattern();
  /// Shows "pattern", "idle", "black", "white", "focus" or "grid". Returns when the picture is visible.
  void project(const std::string& picture, std::chrono::milliseconds timeout = std::chrono::seconds(5));

  /// The state of the service and its devices, and the totals of all scans, as JSON.
  [[nodiscard]] std::string status();
  /// The settings that clouds depend on, as JSON: pattern, calibration, projector, cameras, configuration.
  [[nodiscard]] std::string settings();
  /// The user's role: "observe", "scan" or "administer".
  [[nodiscard]] std::string role();
  /// Reads the configuration again. Returns the tables that need a restart.
  std::vector<std::string> reload();

  /// Calls any method of the protocol by its name. Returns the result and its data.
  /// @param params  a JSON object
  [[nodiscard]] Message call(const std::string& method, const std::string& params = "{}",
                             std::chrono::milliseconds timeout = std::chrono::seconds(5));

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace slsd::client
