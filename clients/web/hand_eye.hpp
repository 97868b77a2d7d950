// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <tl/expected.hpp>

#include "clients/web/request.hpp"

namespace slsd::web {

/// A hand-eye calibration, which all browsers share: a folder of views, and slsd-hand-eye, which takes views with the
/// service and calibrates.
/// @thread thread-safe; an action while another one is under way is refused as busy
class HandEye {
 public:
  HandEye(std::filesystem::path folder, std::filesystem::path socket);

  /// The user's choices, the views, and the outcome or error of the last calculation.
  [[nodiscard]] nlohmann::json state() const;
  /// Carries out what the page asks for:
  ///
  ///     take       a view for the robot's `pose`, with `mounted`, `poses` and the optional `board`, `ruler`,
  ///                `distance_mm`, `measured_mm`; calculates then
  ///     calculate  with the same choices
  ///     drop       the view `look`; calculates with the others
  ///     clear      all views
  ///
  /// @return as state(); a fault of poses or pictures is its `error`
  [[nodiscard]] tl::expected<nlohmann::json, Refusal> act(const nlohmann::json& body);

  /// A picture of a view as PNG, with `cameras`, `camera` and the board's `points_px` in it.
  struct Picture {
    std::string png;
    nlohmann::json about;
  };
  /// @param camera  empty: the first
  [[nodiscard]] tl::expected<Picture, Refusal> picture(const std::string& view, std::string camera) const;

  /// The result, which belongs to the views as they are; there may be none.
  [[nodiscard]] std::filesystem::path file() const { return folder_ / "hand_eye.yml"; }

 private:
  [[nodiscard]] std::optional<Refusal> carry_out(const nlohmann::json& body);
  [[nodiscard]] std::optional<Refusal> choose(const nlohmann::json& body);
  [[nodiscard]] std::optional<Refusal> take(const nlohmann::json& pose);
  [[nodiscard]] std::optional<Refusal> drop(const nlohmann::json& view);
  [[nodiscard]] std::optional<Refusal> clear();
  [[nodiscard]] std::optional<Refusal> calculate();
  [[nodiscard]] std::optional<Refusal> run(const std::string& pose);
  void note(const std::vector<nlohmann::json>& told);
  void remove_result();

  std::filesystem::path folder_, socket_;
  std::mutex acting_;
  mutable std::mutex mutex_;  ///< guards all below
  nlohmann::json choices_;
  std::map<std::string, nlohmann::json> seen_;  ///< what the program told of each view
  nlohmann::json outcome_, error_;
  bool busy_ = false;
};

}  // namespace slsd::web
