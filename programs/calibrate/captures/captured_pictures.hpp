// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <vector>

#include "core/calibrate/observe/observe_pose.hpp"
#include "drivers/files/grey_image.hpp"

namespace slsd {

[[nodiscard]] inline ImageSize size_of(const GreyImage& picture) {
  return std::visit([](const auto& pixels) { return ImageSize{pixels.width(), pixels.height()}; }, picture);
}

/// The pictures of one pose by one camera, owned.
struct CapturedPictures {
  GreyImage white;
  std::vector<GreyImage> coded;  ///< the pattern alone, or the Gray code
  std::optional<GreyImage> black;

  /// Views of the pictures in this object.
  [[nodiscard]] PosePictures views() const;
};

}  // namespace slsd
