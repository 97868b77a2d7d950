// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/calibration.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace slsd {

const CalibratedCamera* Calibration::camera(std::string_view name) const {
  if (cameras.size() == 1) return &cameras.front();
  const auto found = std::find_if(cameras.begin(), cameras.end(), [&](const auto& one) { return one.name == name; });
  return found == cameras.end() ? nullptr : &*found;
}

std::optional<double> CalibrationReport::depth_sigma_mm(double depth_mm) const {
  if (depth_sigma.empty()) return std::nullopt;
  const auto slope = [](const DepthSigma& known) { return known.sigma_mm / (known.depth_mm * known.depth_mm); };
  const double square = depth_mm * depth_mm;
  const auto above = std::ranges::lower_bound(depth_sigma, depth_mm, {}, &DepthSigma::depth_mm);
  if (above == depth_sigma.begin()) return slope(depth_sigma.front()) * square;
  if (above == depth_sigma.end()) return slope(depth_sigma.back()) * square;
  const DepthSigma& below = *std::prev(above);
  return square *
         std::lerp(slope(below), slope(*above), (depth_mm - below.depth_mm) / (above->depth_mm - below.depth_mm));
}

}  // namespace slsd
