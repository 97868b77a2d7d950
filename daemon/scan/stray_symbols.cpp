// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/stray_symbols.hpp"

#include <algorithm>

namespace slsd {
namespace {

constexpr std::size_t kSymbolsMin = 100;
constexpr std::size_t kHardly = 10;  // one point to so many symbols
constexpr std::size_t kMost = 2;     // of another pattern some in a hundred are read, of the right one nearly all

}  // namespace

std::vector<CloudPoint> stray_symbols(Decoder& decoder, const Decoding& decoding, const GreyView& frame, double full) {
  const auto symbols = static_cast<std::size_t>(
      std::ranges::count_if(decoding.regions, [](const RegionSeen& region) { return region.letter >= 0; }));
  if (symbols < kSymbolsMin || decoding.points.size() * kHardly > symbols) return {};
  const auto matches = decoder.read_anywhere(frame, full);
  if (!matches || matches->size() * kMost < symbols) return {};
  std::vector<CloudPoint> strays;
  for (const SymbolMatch& match : *matches) {
    CloudPoint& stray = strays.emplace_back();
    const Eigen::Vector2f seen = match.camera_px.cast<float>(), lit = match.projector_px.cast<float>();
    stray.camera_u = seen.x(), stray.camera_v = seen.y();
    stray.projector_u = lit.x(), stray.projector_v = lit.y();
    stray.camera = decoder.camera_index();
  }
  return strays;
}

}  // namespace slsd
