// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/watch/stray_symbols.hpp"

#include <cstddef>

namespace slsd {
namespace {

constexpr std::size_t kStraysMin = 24;

}  // namespace

std::vector<CloudPoint> stray_symbols(const Decoding& decoding, std::uint8_t camera) {
  if (decoding.off_line.size() < kStraysMin || decoding.off_line.size() < decoding.points.size()) return {};
  std::vector<CloudPoint> strays;
  for (const SymbolMatch& match : decoding.off_line) {
    CloudPoint& stray = strays.emplace_back();
    const Eigen::Vector2f seen = match.camera_px.cast<float>(), lit = match.projector_px.cast<float>();
    stray.camera_u = seen.x(), stray.camera_v = seen.y();
    stray.projector_u = lit.x(), stray.projector_v = lit.y();
    stray.camera = camera;
  }
  return strays;
}

}  // namespace slsd
