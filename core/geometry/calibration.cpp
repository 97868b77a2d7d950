// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/calibration.hpp"

#include <algorithm>

namespace slsd {

const CalibratedCamera* Calibration::camera(std::string_view name) const {
  if (cameras.size() == 1) return &cameras.front();
  const auto found = std::find_if(cameras.begin(), cameras.end(), [&](const auto& one) { return one.name == name; });
  return found == cameras.end() ? nullptr : &*found;
}

}  // namespace slsd
