// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// The keys of the [projector] table that map grey to light.
struct LightOptions {
  double brightness = 1.0;            ///< factor on the light, 0 to 1
  std::vector<double> gamma = {1.0};  ///< one number: the light is the value to this power, 0.1 to 10; or 2 to 256
                                      ///< numbers: rising light, measured at values evenly spaced from 0 to 255
  int black_level = 0;                ///< the value sent for black, 0 to 254, if the projector does not show lower ones

  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const LightOptions&, const LightOptions&) = default;
};

/// The value to send for each grey, so that light is proportional to grey. With the defaults, each grey itself.
/// @thread reentrant
class LightCurve {
 public:
  /// @param options  valid
  explicit LightCurve(const LightOptions& options);

  [[nodiscard]] std::uint8_t operator()(std::uint8_t grey) const { return values_[grey]; }
  [[nodiscard]] bool is_identity() const;
  [[nodiscard]] Grey8 apply(const Grey8& image) const;

 private:
  std::array<std::uint8_t, 256> values_{};
};

}  // namespace slsd
