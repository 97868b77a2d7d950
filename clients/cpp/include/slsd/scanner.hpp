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
  std::string density;                      ///< "symbols" or "pixels"; empty: as the service is configured
  bool normals = false;                     ///< normals of pixels' points
  bool texture = false;                     ///< the intensity of each point, by a second frame under white light
  bool ambient = false;                     ///< less the light of the room, by a third
  bool picture = false;                     ///< the frame with what was decoded drawn in
  bool frames = false;                      ///< the frames themselves
  bool why = false;  ///< the rules that rejected regions, in `reasons` of the description; the picture marks each
                     ///< region by its rule
};

struct StreamOptions {
  std::optional<double> rate_hz;  ///< maximum rate; empty: every frame
  std::string density;            ///< see ScanOptions
  bool normals = false;           ///< normals of pixels' points
  bool shared = false;            ///< shared memory, without a copy; while two clouds are kept, new ones are lost
  std::optional<std::chrono::milliseconds> idle;  ///< next() throws TimedOut where no cloud came for so long
};

/// Clouds as they come, the newest first, over a connection of its own. In a child made by fork it goes on over
/// another.
/// @thread thread-bound
class Stream {
 public:
  /// The next cloud; `lost` counts those that this reader was too slow for. Scans that the service repeats are passed
  /// over. @throws as Connection, and what the service answers where it refuses
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
  /// The start of `for (const Cloud& cloud : stream)`, which ends by `break` or by an exception of next().
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

/// A scanner, as slsd serves it. Requests are answered one after the other. If the connection breaks, the request that
/// waits throws ConnectionLost, and the next one connects anew. After a fork, parent and child have a connection each.
/// Every method throws ScannerError's classes.
/// @thread thread-safe
class Scanner {
 public:
  /// @param socket  of the service; empty: SLSD_SOCKET in the environment, or the usual place
  /// @throws NoService, PermissionDenied
  explicit Scanner(std::string socket = {});
  ~Scanner();
  Scanner(Scanner&&) noexcept;
  Scanner& operator=(Scanner&&) noexcept;

  /// Takes one scan. The points lie in memory that is shared with the service: nothing is copied.
  [[nodiscard]] Cloud scan(const ScanOptions& options = {});
  [[nodiscard]] Stream stream(const StreamOptions& options = {}) const;

  /// A camera's frame, under the pattern; with `as_shown` under what the projector shows by now.
  /// @param camera  its name; empty: the first
  [[nodiscard]] Frame frame(const std::string& camera = {}, bool as_shown = false,
                            std::chrono::milliseconds timeout = std::chrono::seconds(5));
  /// A frame with what was decoded drawn in, as PNG.
  [[nodiscard]] Bytes preview(const std::string& camera = {},
                              std::chrono::milliseconds timeout = std::chrono::seconds(5));
  /// The pattern's image, as PNG.
  [[nodiscard]] Bytes pattern();
  /// Shows "pattern", "idle", "black", "white", "focus" or "grid". Returns when it is visible.
  void project(const std::string& picture, std::chrono::milliseconds timeout = std::chrono::seconds(5));

  /// The service, its devices, and what all scans came to, as JSON.
  [[nodiscard]] std::string status();
  /// The settings that clouds depend on: pattern, calibration, projector, cameras, configuration, as JSON.
  [[nodiscard]] std::string settings();
  /// "observe", "scan" or "administer": what this user may.
  [[nodiscard]] std::string role();
  /// Reads the configuration anew. Returns the tables that need a restart.
  std::vector<std::string> reload();

  /// Any method of the protocol, by its name. Returns the result, and what came with it.
  /// @param params  a JSON object
  [[nodiscard]] Message call(const std::string& method, const std::string& params = "{}",
                             std::chrono::milliseconds timeout = std::chrono::seconds(5));

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace slsd::client
