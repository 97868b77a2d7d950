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

/// The visible cameras, and the configured ones.
/// @thread reentrant
class CameraList {
 public:
  /// Looks for cameras, which takes a second or two.
  [[nodiscard]] static CameraList look(const Configuration& configuration);
  /// @param configuration  must outlive this object
  CameraList(const Configuration& configuration, CameraListing listing);

  /// The list as text: several lines for each camera. Without any camera, tells which places were searched.
  [[nodiscard]] std::string text() const;
  /// `cameras`, `configured` and `looked_at`, as slsd(8) describes them.
  [[nodiscard]] nlohmann::json json() const;
  /// Suggestions for an absent camera: the names of visible cameras with its driver.
  [[nodiscard]] std::string similar_to(const CameraOptions& absent) const;

 private:
  [[nodiscard]] const ListedCamera* find(const CameraOptions& configured) const;
  [[nodiscard]] const CameraOptions* find(const ListedCamera& seen) const;

  const Configuration* configuration_;
  CameraListing listing_;
};

/// Tells whether the options name this camera.
[[nodiscard]] bool names(const CameraOptions& options, const ListedCamera& camera);

/// The monitors of the X server that DISPLAY names.
/// @thread reentrant
class MonitorList {
 public:
  [[nodiscard]] static MonitorList look() { return MonitorList(list_outputs()); }
  explicit MonitorList(Result<std::vector<RandrOutput>> outputs) : outputs_(std::move(outputs)) {}

  /// The list as text: one line for each monitor. Without any monitor, tells why.
  [[nodiscard]] std::string text() const;
  /// An array of monitors, as slsd(8) describes it.
  [[nodiscard]] nlohmann::json json() const;

 private:
  Result<std::vector<RandrOutput>> outputs_;
};

}  // namespace slsd
