// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace slsd {

enum class DeviceState {
  kOpening,  ///< not open yet, nothing has failed
  kReady,
  kFailed,  ///< not open, the last attempt or frame failed; it is tried again
};

[[nodiscard]] constexpr std::string_view to_string(DeviceState state) {
  constexpr std::string_view kNames[] = {"opening", "ready", "failed"};
  return kNames[static_cast<int>(state)];
}

/// What `status` says of a projector or a camera.
struct DeviceStatus {
  std::string name;
  std::string driver;
  std::string device;
  int width_px = 0;
  int height_px = 0;
  DeviceState state = DeviceState::kOpening;
  std::string problem;            ///< empty while it is ready
  std::uint64_t opened = 0;       ///< times
  std::uint64_t frames = 0;       ///< delivered
  std::uint64_t frames_lost = 0;  ///< asked for and not delivered
};

}  // namespace slsd
