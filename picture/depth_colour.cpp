// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/depth_colour.hpp"

#include <algorithm>
#include <array>

#include "picture/canvas.hpp"

namespace slsd {
namespace {

constexpr std::array<Rgb, 7> kStops{
    {{252, 216, 104}, {204, 212, 102}, {124, 198, 126}, {64, 174, 152}, {52, 146, 176}, {72, 116, 182}, {92, 84, 166}}};

}  // namespace

Rgb depth_colour(double share) {
  const double place = std::clamp(share, 0.0, 1.0) * (kStops.size() - 1);
  const std::size_t stop = std::min(static_cast<std::size_t>(place), kStops.size() - 2);
  return mix(kStops[stop], kStops[stop + 1], place - static_cast<double>(stop));
}

}  // namespace slsd
