// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/projector_options.hpp"

#include "daemon/configuration/in_range.hpp"

namespace slsd {

std::string_view to_string(ProjectorDriver driver) {
  return driver == ProjectorDriver::kHeadless ? "headless" : "glfw";
}

Result<> ProjectorOptions::validate() const {
  if (auto valid = in_range("width_px", width_px, 640, 3840); !valid) return valid;
  if (auto valid = in_range("height_px", height_px, 360, 2160); !valid) return valid;
  if (auto valid = light.validate(); !valid) return valid;
  if (auto valid = in_range("idle_after_ms", idle_after_ms, 0, 3'600'000); !valid) return valid;
  if (refresh_hz == 0 || (refresh_hz >= 10 && refresh_hz <= 1000)) return {};
  return fail(ErrorCode::kInvalidArgument, "refresh_hz must be 10 to 1000, or 0 for a projector that lights steadily");
}

}  // namespace slsd
