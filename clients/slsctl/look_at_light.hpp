// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <tl/expected.hpp>

#include "clients/slsctl/ask.hpp"
#include "clients/slsctl/client_options.hpp"
#include "core/exposure/exposure_advice.hpp"
#include "drivers/files/grey_image.hpp"

namespace slsd {

/// A camera's frame under the pattern, and its light.
struct SeenLight {
  std::string camera;  ///< its name; empty for frames from files
  GreyImage frame;
  FrameLight light;
  std::optional<ExposureSetting> present;
  ExposureAdvice advice;
};

/// Adds a scan, for what only decoded symbols show: the pattern's pitch.
enum class LookAtPitch : bool { kNo, kYes };

/// Takes two frames of the camera one after the other, or reads the files of --from. If a scan fails, as without a
/// calibration, the pitch is not measured.
[[nodiscard]] tl::expected<SeenLight, Failure> look_at_light(const ClientOptions& options, LookAtPitch pitch);

/// The troubles with their remedies, each on a line.
[[nodiscard]] std::string troubles_text(const std::vector<Trouble>& troubles);
[[nodiscard]] nlohmann::json troubles_json(const std::vector<Trouble>& troubles);

}  // namespace slsd
