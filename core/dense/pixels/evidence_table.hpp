// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <vector>

namespace slsd {

/// Evidence of a pixel for a surface against two alternatives: another surface, on which dark and light are equally
/// likely, and an unlit one. Each is the natural logarithm of how much likelier the pixel's level is.
struct Evidence {
  float against_another = 0, against_unlit = 0;

  [[nodiscard]] float least() const { return against_another < against_unlit ? against_another : against_unlit; }
  Evidence& operator+=(const Evidence& more) {
    against_another += more.against_another, against_unlit += more.against_unlit;
    return *this;
  }
  Evidence& operator-=(const Evidence& less) {
    against_another -= less.against_another, against_unlit -= less.against_unlit;
    return *this;
  }
};

/// Precomputed evidence, by a pixel's expected and observed light, the slope of the light and the noise. All are in
/// units of the gain. The light of a saturated pixel is that of the full level or more.
/// @thread reentrant
class EvidenceTable {
 public:
  EvidenceTable();
  /// @param expected  0 to 1
  /// @param seen      0 for dark, 1 for lit
  /// @param slope     slope of the light, for one camera px
  /// @param noise     one standard deviation of a pixel
  /// @param saturated  the light is seen or more
  [[nodiscard]] Evidence at(float expected, float seen, float slope, float noise, bool saturated = false) const;

  /// Returns the table for a noise: kSeen entries to a row, kExpected rows to a slope; then the same for saturated
  /// pixels. The upper half of each entry is the evidence against another surface, the lower against none, both signed
  /// and in steps of kUnit.
  [[nodiscard]] const std::uint32_t* entries(float noise) const;

  static constexpr float kUnit = 1.F / 1024;
  static constexpr int kExpected = 17, kSeen = 48, kSlopes = 4, kNoises = 6;
  static constexpr int kOfLight = kExpected * kSeen * kSlopes;  ///< number of entries before those of saturated pixels
  static constexpr float kSeenFirst = -0.5F, kSeenStep = 0.05F, kSlopeStep = 0.1F, kNoiseFirst = 0.01F;

  /// The same, computed without the table.
  [[nodiscard]] static Evidence reckon(float expected, float seen, float slope, float noise, bool saturated = false);

 private:
  std::vector<std::uint32_t> table_;
};

}  // namespace slsd
