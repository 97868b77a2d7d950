// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "daemon/configuration/configuration.hpp"
#include "drivers/camera/listing/list_cameras.hpp"
#include "drivers/projector/x11/randr_output.hpp"

namespace slsd {

/// The cameras that this host can see, and those that the configuration names.
/// @thread reentrant
class CameraList {
 public:
  /// Looks for cameras, which takes a second or two.
  [[nodiscard]] static CameraList look(const Configuration& configuration);
  /// @param configuration  outlives this
  CameraList(const Configuration& configuration, CameraListing listing);

  /// The list for people: several lines to a camera. Without any camera it tells what was looked at.
  [[nodiscard]] std::string text() const;
  /// `cameras`, `configured` and `looked_at`, as slsd(8) says.
  [[nodiscard]] nlohmann::json json() const;
  /// The suggestions for a camera that is absent: the names of those of its driver.
  [[nodiscard]] std::string similar_to(const CameraOptions& absent) const;

 private:
  [[nodiscard]] const ListedCamera* find(const CameraOptions& configured) const;
  [[nodiscard]] const CameraOptions* find(const ListedCamera& seen) const;

  const Configuration* configuration_;
  CameraListing listing_;
};

/// Tells whether this is the camera that the options name.
[[nodiscard]] bool names(const CameraOptions& options, const ListedCamera& camera);

/// The monitors of the X server that DISPLAY names.
/// @thread reentrant
class MonitorList {
 public:
  [[nodiscard]] static MonitorList look() { return MonitorList(list_outputs()); }
  explicit MonitorList(Result<std::vector<RandrOutput>> outputs) : outputs_(std::move(outputs)) {}

  /// The list for people: a line to a monitor. Without any monitor it tells why.
  [[nodiscard]] std::string text() const;
  /// An array of monitors, as slsd(8) says.
  [[nodiscard]] nlohmann::json json() const;

 private:
  Result<std::vector<RandrOutput>> outputs_;
};

}  // namespace slsd
