// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <atomic>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace slsd {

/// Status of a region. Everything but kDecoded is a reason for rejection.
enum class RegionStatus : std::uint8_t {
  kDecoded,
  kTooSmall,
  kTooLarge,
  kTouchesBorder,
  kLowContrast,
  kUnknownShape,        ///< resembles none of the pattern's symbols
  kNoNeighbour,         ///< too few links to read a codeword
  kNoCodeword,          ///< no window around it is in the pattern, within the correctable distance
  kAmbiguousCodeword,   ///< the windows around it disagree
  kClassDisagrees,      ///< its shape differs from that of the cell which its windows name
  kNeighboursDisagree,  ///< its neighbours' shapes differ from those of the cells around that cell
  kDamagedShape,        ///< its shape is that of its cell, but cut or disturbed: its centre would be wrong
  kOffEpipolarLine,
  kOutOfDepthRange,
  kDuplicateCell,  ///< another region also claims the cell
};
inline constexpr int kRegionStatusCount = 15;

/// "too_small", as in the counters of `status`.
[[nodiscard]] std::string_view to_string(RegionStatus status);

/// Rules that decide on a symbol: the ways to accept it, each test that rejects it, and each guard that prevents
/// recovery. Their texts are in rules.cpp, in this order.
enum class DecodeRule : std::uint8_t {
  kCertain,
  kRecovered,
  // Regions.
  kTouchesBorder,
  kTooSmall,
  kTooLarge,
  kLowContrast,
  // Cells.
  kNoNeighbour,
  kNoWindow,
  kNoLetter,
  kOtherLetter,
  kUncertain,
  kCellOffLine,
  kCellOutOfRange,
  // Shapes.
  kSplit,
  kUnlikeLetter,
  kCutCentre,
  kNotAligned,
  // Places.
  kSymbolOffLine,
  kSymbolOutOfRange,
  kCellTwice,
  kPointOutOfRange,
  // Guards.
  kRecoverUnsettled,
  kRecoverOffLine,
  kRecoverMoved,
  kRecoverTilted,
  kRecoverHidden,
  kRecoverUnlike,
};
inline constexpr std::size_t kDecodeRuleCount = static_cast<std::size_t>(DecodeRule::kRecoverUnlike) + 1;

enum class RuleKind : std::uint8_t {
  kAccepts,
  kRejects,
  kGuards,  ///< prevents recovery; another rule decides on the symbol
};

/// "rejects", as in the metrics.
[[nodiscard]] std::string_view to_string(RuleKind kind);

struct RuleText {
  std::string_view name;  ///< "too_small", as in the counters
  RuleKind kind;
  RegionStatus gives;        ///< resulting status of a symbol; none for a guard
  bool has_switch;           ///< whether the decoder can do without it
  std::string_view meaning;  ///< one sentence
  std::string_view remedy;   ///< action that a user may take
};

[[nodiscard]] const RuleText& text_of(DecodeRule rule);
[[nodiscard]] inline std::string_view to_string(DecodeRule rule) {
  return text_of(rule).name;
}
/// Number of a rule in docs/reasons.md and in the pictures, from 1.
[[nodiscard]] inline int number_of(DecodeRule rule) {
  return static_cast<int>(rule) + 1;
}
[[nodiscard]] inline DecodeRule decode_rule(std::size_t index) {
  return static_cast<DecodeRule>(index);
}

/// Number of regions that each rule decided on.
using RuleCounts = std::array<std::uint32_t, kDecodeRuleCount>;

using RuleSet = std::bitset<kDecodeRuleCount>;

/// Trial of a decoder's rules, for tools and tests. It names the rules to leave out, collects those that applied, and
/// may ask for margins beyond the required one. It may change between frames.
/// @thread set and read while no decoder runs
struct RuleTrial {
  RuleSet off;
  bool whole_margins = false;
  std::array<std::atomic<bool>, kDecodeRuleCount> met{};

  void forget() {
    for (auto& one : met) one = false;
  }
};

/// Access of a stage to its rules. A service has no trial and leaves no rule out.
class Rules {
 public:
  Rules() = default;
  explicit Rules(RuleTrial* trial) : trial_(trial) {}

  /// Tells whether a rule applies: its test holds, and it is not left out.
  [[nodiscard]] bool apply(DecodeRule rule, bool holds) const { return holds && (trial_ == nullptr || tried(rule)); }
  [[nodiscard]] bool whole_margins() const { return trial_ != nullptr && trial_->whole_margins; }

 private:
  [[nodiscard]] bool tried(DecodeRule rule) const {
    trial_->met[static_cast<std::size_t>(rule)].store(true, std::memory_order_relaxed);
    return !trial_->off.test(static_cast<std::size_t>(rule));
  }

  RuleTrial* trial_ = nullptr;
};

}  // namespace slsd
