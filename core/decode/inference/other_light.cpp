// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/inference/other_light.hpp"

#include <variant>

namespace slsd {

float OtherLight::share(int letter, const Place& place) const {
  constexpr int kSamples = 13;    // across a cell
  constexpr float kDark = 0.15F;  // of the letter's light
  constexpr float kLit = 0.4F;    // of the way from background to peak
  const Eigen::Vector2f middle = letters_.middle_px(letter);
  const float lit_from = place.background + kLit * (place.peak - place.background);
  return std::visit(
      [&](const auto& view) -> float {
        int lit = 0;
        for (int j = 0; j < kSamples; ++j) {
          for (int i = 0; i < kSamples; ++i) {
            const Eigen::Vector2f sample(static_cast<float>(i), static_cast<float>(j));
            const Eigen::Vector2f at = ((sample.array() + 0.5F) / kSamples - 0.5F) * pitch_px_;
            const Eigen::Vector2f px = place.centre_px + place.frame * at;
            const auto [x, y] = std::pair(static_cast<int>(px.x() + 0.5F), static_cast<int>(px.y() + 0.5F));
            if (px.minCoeff() < 0 || x >= view.width || y >= view.height) return -1;
            if (field_.at(middle.x() + at.x(), middle.y() + at.y()).value >= kDark) continue;
            lit += static_cast<float>(view.row(y)[x]) > lit_from;
          }
        }
        return static_cast<float>(lit) / (kSamples * kSamples);
      },
      frame_);
}

}  // namespace slsd
