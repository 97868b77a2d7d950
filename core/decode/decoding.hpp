// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/cloud/cloud.hpp"
#include "core/decode/centres/symbol_match.hpp"
#include "core/decode/rules.hpp"
#include "core/decode/symbol_light.hpp"
#include "core/regions/direction.hpp"

namespace slsd {

enum class Stage : std::uint8_t {
  kBinarize,
  kFindRegions,
  kDescribe,
  kClassify,
  kLinkGrid,
  kDecodeWindows,
  kReview,
  kCorrespond,
  kAlign,  ///< only with precision "fine"
  kTriangulate
};
inline constexpr int kStageCount = 10;
[[nodiscard]] std::string_view to_string(Stage stage);

/// One region of the frame, accepted or not: the data from which pictures are drawn.
struct RegionSeen {
  Eigen::Vector2f centre_px;  ///< place in the camera's image
  RegionStatus status;
  std::int8_t letter;                              ///< index in the pattern's symbols, or -1
  std::array<std::int32_t, 4> links;               ///< by Direction: index of the neighbour's region, or -1
  std::array<bool, 4> broken;                      ///< a link that was removed because it disagreed with its neighbours
  std::int16_t column, row;                        ///< cell of the pattern; -1 unless decoded
  DecodeRule rule = DecodeRule::kCertain;          ///< the rule that decided on its status
  std::optional<DecodeRule> guard = std::nullopt;  ///< the last guard that kept it from being recovered
  float margin_nats = 0;                           ///< margin of its cell over any other, up to the required margin
};

using RegionCounts = std::array<std::uint32_t, kRegionStatusCount>;

/// Results of one frame: its points, and the status of every region.
struct Decoding {
  std::vector<CloudPoint> points;
  std::vector<RegionSeen> regions;
  /// Symbols whose cells are certain but lie off their epipolar lines. The rig has lost its calibration, or another
  /// projector lights them.
  std::vector<SymbolMatch> off_line;
  RegionCounts counts{};  ///< regions by status
  RuleCounts rules{};     ///< regions by rule, and regions that each guard rejected
  SymbolLight light{};

  [[nodiscard]] std::uint32_t count(RegionStatus status) const { return counts[static_cast<std::size_t>(status)]; }
};

/// Observer of a decoder's stages, called as each ends. The daemon times stages with it, as core has no clocks.
class StageObserver {
 public:
  virtual ~StageObserver() = default;
  virtual void stage_done(Stage stage) = 0;
};

}  // namespace slsd
