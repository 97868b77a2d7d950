// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "drivers/camera/camera.hpp"

namespace slsd {

/// The state of a camera or the projector. docs/supervision.md draws the transitions.
enum class DeviceState {
  kAbsent,     ///< no device of that name answers; searched for again
  kOpening,    ///< being opened and configured
  kReady,      ///< open, waiting for a trigger
  kCapturing,  ///< a frame is under way
  kFaulted,    ///< failed, or present but does not open; will be reopened
};

[[nodiscard]] constexpr std::string_view to_string(DeviceState state) {
  constexpr std::string_view kNames[] = {"absent", "opening", "ready", "capturing", "faulted"};
  return kNames[static_cast<int>(state)];
}

[[nodiscard]] constexpr bool is_open(DeviceState state) {
  return state == DeviceState::kReady || state == DeviceState::kCapturing;
}

/// The state of a device whose open() failed.
[[nodiscard]] constexpr DeviceState state_after(ErrorCode code) {
  const bool nothing_there = code == ErrorCode::kNotFound || code == ErrorCode::kDisconnected;
  return nothing_there ? DeviceState::kAbsent : DeviceState::kFaulted;
}

/// The status of a projector or a camera, as `status` reports it.
struct DeviceStatus {
  std::string name;
  std::string driver;
  std::string device;
  std::string hardware;  ///< identifies the device wherever it is plugged in; empty: unknown
  int width_px = 0;
  int height_px = 0;
  DeviceState state = DeviceState::kOpening;
  std::string problem;            ///< why it is not open; empty while it is open
  std::string shows;              ///< a projector's picture: "pattern", "white", "black", "idle" or "held"; empty: none
  std::uint64_t opened = 0;       ///< number of times that it was opened
  std::uint64_t frames = 0;       ///< frames delivered
  std::uint64_t frames_lost = 0;  ///< frames requested but not delivered, or missing between two delivered ones
  std::map<ErrorCode, std::uint64_t> frames_failed;  ///< lost frames that an error reported
  std::vector<DriverFigure> figures;                 ///< figures of the driver itself
};

/// The statuses of all devices of a rig.
struct RigStatus {
  DeviceStatus projector;
  std::vector<DeviceStatus> cameras;  ///< in the order of the configuration
};

}  // namespace slsd
