// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/image.hpp"

namespace slsd {

/// A camera's tone curve: its levels are the light to a power, as shares of the full level. The power is 1 for
/// industrial cameras; webcams have 0.45 to 0.75 (1/2.2: IEC 61966-2-1).
/// @thread thread-bound: keeps its buffers
class ToneCurve {
 public:
  static constexpr double kFull = 65535;  ///< the full level of light_of()

  [[nodiscard]] float power() const { return power_; }
  [[nodiscard]] bool is_straight() const { return power_ == 1; }
  /// Sets the power, within 0.3 and 1. Powers so near to 1 that they may be an error of the estimate become 1.
  void set_power(float power);
  /// Light of a frame's pixels, kFull at the full level.
  /// @param full  the level of a saturated pixel
  /// @return      valid until the next call
  [[nodiscard]] const Grey16& light_of(const GreyView& frame, double full);
  /// Light of a level, kFull at the full level; any level if the curve is straight.
  [[nodiscard]] float light_of(float level, double full) const;
  /// The levels of the lights 0 to 255, likewise of 255.
  [[nodiscard]] std::array<std::uint8_t, 256> levels_of_lights() const;

 private:
  float power_ = 1;
  std::vector<std::uint16_t> lights_;  // for each level
  double lights_full_ = 0;             // the full level of these
  Grey16 light_;
};

}  // namespace slsd
