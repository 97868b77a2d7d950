// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/dense/part_of_cloud.hpp"
#include "core/result.hpp"

namespace slsd {

/// The [cloud] table.
struct CloudOptions {
  std::vector<double> box = {};  ///< x y z of two corners in the rig's frame, mm, the least first; empty: everything
  double voxel_mm = 0;           ///< 0 to 1000; 0: all points
  int stride = 1;                ///< of pixels, 1 to 64

  [[nodiscard]] Result<> validate() const;
  [[nodiscard]] CloudPart part() const;
  friend bool operator==(const CloudOptions&, const CloudOptions&) = default;
};

}  // namespace slsd
