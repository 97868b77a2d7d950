// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "clients/connection/connection.hpp"
#include "daemon/scan/rig/device_status.hpp"
#include "programs/calibrate/session/pose_source.hpp"

namespace slsd {

/// The projector and the cameras of a running service, which keeps them. `project` shows pictures; `frame` takes them
/// with one camera after another, while the board is held still.
/// @thread thread-bound
class SocketSource final : public PoseSource {
 public:
  /// @errors of Connection::open(), and of the service; kNotFound: the service has no camera
  [[nodiscard]] static Result<std::unique_ptr<SocketSource>> create(const std::filesystem::path& socket);

  [[nodiscard]] const std::vector<std::string>& cameras() const override { return names_; }
  [[nodiscard]] ImageSize projector() const override { return projector_; }
  void show(const Grey8& image) override;
  [[nodiscard]] Result<std::vector<GreyImage>> grab() override;

  /// The pattern in force, as a file's text.
  [[nodiscard]] const std::string& pattern() const { return pattern_; }
  /// The calibration file in force; empty: none.
  [[nodiscard]] const std::filesystem::path& calibration() const { return calibration_; }
  /// The status of the devices.
  [[nodiscard]] const RigStatus& status() const { return status_; }

 private:
  explicit SocketSource(Connection connection) : connection_(std::move(connection)) {}
  [[nodiscard]] Result<Received> ask(std::string_view method, const nlohmann::json& params);
  [[nodiscard]] Result<> learn();
  [[nodiscard]] Result<> show_now();

  Connection connection_;
  std::vector<std::string> names_;
  ImageSize projector_;
  std::string pattern_;
  std::filesystem::path calibration_;
  RigStatus status_;
  Grey8 wanted_;
  bool shown_ = false;  ///< the projector shows wanted_
};

}  // namespace slsd
