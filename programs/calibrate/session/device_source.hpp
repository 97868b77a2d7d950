// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "daemon/configuration/configuration.hpp"
#include "daemon/scan/rig/rig.hpp"
#include "programs/calibrate/session/pose_source.hpp"

namespace slsd {

/// The configured projector and cameras. Lost devices are reopened.
/// @thread thread-bound; each camera has a thread of its own
class DeviceSource final : public PoseSource {
 public:
  /// Begins to open the devices; grab() waits for them.
  /// @errors kUnsupported: this build lacks a driver; kNotFound: no camera is configured
  [[nodiscard]] static Result<std::unique_ptr<DeviceSource>> create(const Configuration& configuration);

  [[nodiscard]] const std::vector<std::string>& cameras() const override { return names_; }
  [[nodiscard]] ImageSize projector() const override { return projector_; }
  void show(const Grey8& image) override;
  [[nodiscard]] Result<std::vector<GreyImage>> grab() override;
  [[nodiscard]] RigStatus status() const { return rig_.status(); }

 private:
  DeviceSource(std::unique_ptr<Projector> projector, std::vector<std::unique_ptr<Camera>> cameras,
               std::vector<std::string> names, const ScanOptions& options);

  std::vector<std::string> names_;
  ImageSize projector_;
  ScanOptions options_;
  Grey8 shown_;
  Rig rig_;
};

}  // namespace slsd
