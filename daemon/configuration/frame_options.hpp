// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>

#include "core/result.hpp"

namespace slsd {

/// The frame of a cloud's points.
enum class CoordinateFrame {
  kRig,        ///< the first camera's
  kRobotBase,  ///< the robot's, by a hand-eye calibration
};

/// The [frame] table.
struct FrameOptions {
  CoordinateFrame output = CoordinateFrame::kRig;  ///< of clouds whose request names none
  std::filesystem::path hand_eye;                  ///< hand_eye.yml; empty: the scanner's place is unknown

  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const FrameOptions&, const FrameOptions&) = default;
};

}  // namespace slsd
