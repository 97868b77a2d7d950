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
  return in_range("height_px", height_px, 360, 2160);
}

}  // namespace slsd
