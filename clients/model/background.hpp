// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <vector>

#include "clients/model/range_image.hpp"
#include "core/cloud/read_dense_ply.hpp"
#include "core/geometry/calibration.hpp"
#include "core/result.hpp"

namespace slsd::model {

/// The scene without the object, as each camera measured it: table, wall, clamps.
class Background {
 public:
  /// @param points  a dense cloud of the scene without the object
  /// @errors kMismatch: the cloud is not of this calibration; kMalformed: it has no points
  [[nodiscard]] static Result<Background> of(std::span<const DensePoint> points, const Calibration& calibration);

  /// Removes the pixels that see the background, and crops the images to the rest. A pixel sees it if its depth is that
  /// of the background within four sigmas of their difference, or greater. At the background's own edges a pixel sees
  /// now this surface, now that, so the nearest of the pixels beside it counts.
  void remove_from(std::vector<RangeImage>& images) const;

 private:
  std::vector<RangeImage> images_;
};

}  // namespace slsd::model
