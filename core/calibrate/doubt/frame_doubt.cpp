// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/doubt/frame_doubt.hpp"

#include <cstdint>
#include <numeric>
#include <vector>

#include <fmt/format.h>

#include "core/decode/pattern_reader.hpp"
#include "core/geometry/epipolar/epipolar_limit.hpp"

namespace slsd {
namespace {

constexpr const char* kLook =
    "check light and focus, look at a decoded frame (slsctl preview), and check that the projector shows this pattern "
    "(slsd --pattern)";

}  // namespace

std::string doubt_by_frame(const GreyView& frame, const Pattern& pattern, const Calibration& calibration,
                           std::size_t camera, const DepthRange& range, std::size_t& read) {
  PatternReader reader{IndexedPattern(pattern)};
  const auto symbols = reader.read(frame);
  read = symbols ? symbols->size() : 0;
  if (read < kSymbolsForDoubt) return {};
  std::vector<Match> matches;
  for (const SymbolMatch& symbol : *symbols) {
    matches.push_back({symbol.camera_px.cast<double>(), symbol.projector_px.cast<double>()});
  }
  return symbol_doubt(matches, {calibration.cameras[camera], calibration.projector}, range,
                      epipolar_gate_px(calibration.report.epipolar_error_px));
}

std::string doubt_by_counts(const RegionCounts& regions) {
  const auto seen = std::accumulate(regions.begin(), regions.end(), std::uint64_t{0});
  const auto count = [&](RegionStatus status) { return regions[static_cast<std::size_t>(status)]; };
  const std::uint32_t off_line = count(RegionStatus::kOffEpipolarLine), far = count(RegionStatus::kOutOfDepthRange);
  if (far > off_line && far >= kSymbolsForDoubt) {
    return fmt::format(
        "{} symbols lie outside the working range: check depth_min_mm and depth_max_mm in [decode], and the "
        "calibration",
        far);
  }
  if (off_line >= kSymbolsForDoubt) {
    return fmt::format(
        "{} symbols lie off their epipolar lines: the calibration belongs to another rig, or the projector or a camera "
        "moved: calibrate again",
        off_line);
  }
  return fmt::format("no symbol of the pattern was decoded among {} bright regions: {}", seen, kLook);
}

}  // namespace slsd
