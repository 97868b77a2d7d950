// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/merge_exposures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "core/exposure/frame_noise.hpp"
#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

constexpr int kBlockPx = 8;
constexpr int kFits = 8;
constexpr double kUsable = 0.97;                          // of full: sensors bend before they saturate
constexpr double kRatioPrior = 0.2;                       // one sigma, relative: cameras round exposures
constexpr double kOffsetPrior = 0.1;                      // one sigma, of full: black levels
constexpr double kBlockNoiseLeast = 0.05;                 // levels
constexpr double kBrighterMin = 0.7, kBrighterMax = 1.4;  // of the ratio of the exposures
constexpr double kUnlikeSigmas = 5;
constexpr double kUnlikeOfLevel = 0.02;  // the projector's light and a codec vary by less
constexpr double kUnlikeShareMax = 0.01;
constexpr std::size_t kExcessLevels = 16;
constexpr std::size_t kExcessSamplesMin = 60;
constexpr int kExcessStep = 5;
constexpr double kExcessMax = 3;

/// longer = offset + brighter * shorter
struct Line {
  double offset = 0;
  double brighter = 1;

  [[nodiscard]] double longer(double shorter) const { return offset + brighter * shorter; }
  [[nodiscard]] double shorter(double longer) const { return (longer - offset) / brighter; }
};

struct BlockMeans {
  double shorter = 0;
  double longer = 0;
};

template <class T>
std::vector<BlockMeans> unsaturated_blocks(const ImageView<T>& shorter, const ImageView<T>& longer, double full) {
  std::vector<BlockMeans> blocks;
  for (int top = 0; top + kBlockPx <= shorter.height; top += kBlockPx) {
    for (int left = 0; left + kBlockPx <= shorter.width; left += kBlockPx) {
      unsigned sum_shorter = 0, sum_longer = 0, greatest = 0;
      for (int y = top; y < top + kBlockPx; ++y) {
        for (int x = left; x < left + kBlockPx; ++x) {
          sum_shorter += shorter.at(x, y), sum_longer += longer.at(x, y);
          greatest = std::max({greatest, unsigned{shorter.at(x, y)}, unsigned{longer.at(x, y)}});
        }
      }
      constexpr double kPixels = kBlockPx * kBlockPx;
      if (greatest < kUsable * full) blocks.push_back({sum_shorter / kPixels, sum_longer / kPixels});
    }
  }
  return blocks;
}

// Least squares. The priors decide if the blocks do not: a black frame, or one without an unsaturated block.
Line fit_once(const std::vector<BlockMeans>& blocks, const std::vector<double>& weights, double noise, double full,
              double ratio) {
  const double of_ratio = std::pow(noise / (kRatioPrior * ratio), 2),
               of_offset = std::pow(noise / (kOffsetPrior * full), 2);
  double n = of_offset, s = 0, ss = of_ratio, l = 0, sl = of_ratio * ratio;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const auto& [shorter, longer] = blocks[i];
    n += weights[i], s += weights[i] * shorter, ss += weights[i] * shorter * shorter;
    l += weights[i] * longer, sl += weights[i] * shorter * longer;
  }
  const double determinant = n * ss - s * s;
  return {(ss * l - s * sl) / determinant, (n * sl - s * l) / determinant};
}

Line fit_line(const std::vector<BlockMeans>& blocks, double full, double ratio) {
  std::vector<double> weights(blocks.size(), 1), off(blocks.size());
  double noise = 1;
  Line line{0, ratio};
  for (int fit = 0; fit < kFits; ++fit) {
    line = fit_once(blocks, weights, noise, full, ratio);
    for (std::size_t i = 0; i < blocks.size(); ++i)
      off[i] = std::abs(blocks[i].longer - line.longer(blocks[i].shorter));
    noise = std::max(kSigmaOfMedian * median_of(off), kBlockNoiseLeast);
    for (std::size_t i = 0; i < blocks.size(); ++i) weights[i] = robust_weight(off[i], 3 * noise);
  }
  return line;
}

/// The merging of a pixel, by its level in the longer frame.
struct LevelRule {
  float shorter = 0;  ///< the expected level in the shorter frame
  float share = 0;    ///< of the expected level in the mean; 0 if the longer frame is saturated
  float lowest = 0;   ///< levels of the shorter frame that agree
  float highest = 0;
};

/// The noise of both frames by level of the longer one, each in levels of its frame.
struct NoisePair {
  FrameNoise shorter;
  FrameNoise longer;
};

/// Ratio of the measured difference of both frames to that of their noise, by level of the longer frame. It is above 1
/// for correlated noise, as a codec's. It is bounded, because a frame that moved as a whole must not explain itself.
using Excess = std::array<double, kExcessLevels>;

std::size_t excess_level(double longer, double full) {
  return std::min(static_cast<std::size_t>(longer / full * kExcessLevels), kExcessLevels - 1);
}

double expected_difference(const Line& line, const NoisePair& noise, double longer) {
  const auto shorter = static_cast<float>(line.shorter(longer));
  return std::hypot(noise.shorter.at(shorter), noise.longer.at(static_cast<float>(longer)) / line.brighter);
}

template <class T>
Excess measure_excess(const ImageView<T>& shorter, const ImageView<T>& longer, const Line& line, const NoisePair& noise,
                      double full) {
  std::array<std::vector<double>, kExcessLevels> off;
  for (int y = 0; y < longer.height; y += kExcessStep) {
    for (int x = y % 2; x < longer.width; x += kExcessStep) {
      const double level = longer.at(x, y);
      if (level < kUsable * full)
        off[excess_level(level, full)].push_back(std::abs(line.shorter(level) - shorter.at(x, y)));
    }
  }
  Excess excess;
  for (std::size_t i = 0; i < kExcessLevels; ++i) {
    const double middle = (static_cast<double>(i) + 0.5) * full / kExcessLevels;
    const double measured = kSigmaOfMedian * median_of(off[i]) / expected_difference(line, noise, middle);
    excess[i] = off[i].size() < kExcessSamplesMin ? 1 : std::clamp(measured, 1.0, kExcessMax);
  }
  return excess;
}

std::vector<LevelRule> rules_of(const Line& line, const NoisePair& noise, const Excess& excess, double full,
                                std::size_t levels) {
  std::vector<LevelRule> rules(levels);
  for (std::size_t level = 0; level < levels; ++level) {
    const bool usable = static_cast<double>(level) < kUsable * full;
    const double longer = usable ? static_cast<double>(level) : kUsable * full, shorter = line.shorter(longer);
    const double apart = kUnlikeSigmas * excess[excess_level(longer, full)] * expected_difference(line, noise, longer) +
                         kUnlikeOfLevel * longer / line.brighter;
    const double share =
        std::pow(noise.shorter.at(static_cast<float>(shorter)) / expected_difference(line, noise, longer), 2);
    rules[level] = {static_cast<float>(shorter), usable ? static_cast<float>(share) : 0,
                    static_cast<float>(shorter - apart),
                    usable ? static_cast<float>(shorter + apart) : std::numeric_limits<float>::infinity()};
  }
  return rules;
}

float scale_to_merged(double full) {
  return static_cast<float>(kMergedFull / full);
}

// The level of a pixel that is not saturated.
std::uint16_t merged_level(float level) {
  return static_cast<std::uint16_t>(std::clamp(level + 0.5F, 0.0F, static_cast<float>(kMergedFull - 1)));
}

// Spreads a whole level evenly over its rounding. Otherwise the steps between levels would pass for noise, or hide it.
float dithered(float level, int x, int y) {
  if (level <= 0) return level;
  auto hash = static_cast<std::uint32_t>(x) * 0x9E3779B1U ^ static_cast<std::uint32_t>(y) * 0x85EBCA77U;
  hash = (hash ^ hash >> 15) * 0xC2B2AE3DU;
  return level + static_cast<float>(hash >> 8) * 0x1p-24F - 0.5F;
}

// @return the number of pixels that differ beyond noise
template <class T>
std::size_t merge_rows(const ImageView<T>& shorter, const ImageView<T>& longer, const std::vector<LevelRule>& rules,
                       double full, Grey16& merged) {
  const float scale = scale_to_merged(full);
  const auto saturated = static_cast<unsigned>(full);
  std::size_t unlike = 0;
  for (int y = 0; y < shorter.height; ++y) {
    const T* const from_shorter = shorter.row(y);
    const T* const from_longer = longer.row(y);
    std::uint16_t* const to = merged.row(y);
    for (int x = 0; x < shorter.width; ++x) {
      const LevelRule& rule = rules[from_longer[x]];
      const float level = from_shorter[x];
      const bool agrees = level >= rule.lowest && level <= rule.highest;
      unlike += agrees ? 0 : 1;
      const bool alone = !agrees || rule.share == 0;
      const float mean = alone ? dithered(level, x, y) : level + rule.share * (rule.shorter - level);
      to[x] = from_shorter[x] >= saturated ? static_cast<std::uint16_t>(kMergedFull) : merged_level(mean * scale);
    }
  }
  return unlike;
}

tl::unexpected<Error> fail_brightness(double brighter, double ratio) {
  char text[240];
  std::snprintf(text, sizeof text,
                "the longer exposure is %.2f times as bright as the shorter, not %.2f times: the camera did not take "
                "an exposure, or its levels do not follow the light; turn automatic functions and gamma off",
                brighter, ratio);
  return fail(ErrorCode::kMismatch, text);
}

tl::unexpected<Error> fail_moved(double share) {
  char text[160];
  std::snprintf(text, sizeof text,
                "%.1f %% of the pixels differ between the two exposures beyond noise: the scene or its light changed; "
                "keep both still",
                100 * share);
  return fail(ErrorCode::kMismatch, text);
}

template <class T>
Result<MergedExposures> merge(const ImageView<T>& shorter, const ImageView<T>& longer, double full, double ratio) {
  const Line line = fit_line(unsaturated_blocks(shorter, longer, full), full, ratio);
  if (!(line.brighter >= kBrighterMin * ratio && line.brighter <= kBrighterMax * ratio))
    return fail_brightness(line.brighter, ratio);
  const NoisePair noise{measure_noise(shorter, full), measure_noise(longer, full)};
  const Excess excess = measure_excess(shorter, longer, line, noise, full);
  const auto rules = rules_of(line, noise, excess, full, std::size_t{1} << (8 * sizeof(T)));
  MergedExposures merged{Grey16(shorter.width, shorter.height), line.brighter, 0};
  const std::size_t unlike = merge_rows(shorter, longer, rules, full, merged.image);
  if (merged.image.empty()) return merged;
  merged.unlike_share = static_cast<double>(unlike) / static_cast<double>(merged.image.size());
  if (merged.unlike_share > kUnlikeShareMax) return fail_moved(merged.unlike_share);
  return merged;
}

}  // namespace

Result<MergedExposures> merge_exposures(const GreyView& shorter, const GreyView& longer, double full, double ratio) {
  if (!(ratio > 1 && std::isfinite(ratio)))
    return fail(ErrorCode::kInvalidArgument, "the longer exposure must be longer than the shorter one");
  if (!(full >= 1 && full <= kMergedFull))
    return fail(ErrorCode::kInvalidArgument, "the level of a saturated pixel must be 1 to 65535");
  if (size_of(shorter) != size_of(longer) || shorter.index() != longer.index())
    return fail(ErrorCode::kMismatch, "the two exposures have different sizes or depths");
  return std::visit(
      [&]<class T>(const ImageView<T>& view) { return merge(view, std::get<ImageView<T>>(longer), full, ratio); },
      shorter);
}

MergedPictures merge_pictures(std::span<const ExposurePair> pairs, double full, double ratio) {
  MergedPictures merged;
  for (const auto& [shorter, longer] : pairs) {
    auto both = merge_exposures(shorter, longer, full, ratio);
    if (!both) {
      merged.problem = both.error().message;
      break;
    }
    merged.images.push_back(std::move(both->image));
  }
  if (merged.problem.empty()) return merged;
  merged.images.clear();
  for (const ExposurePair& pair : pairs) merged.images.push_back(as_merged(pair.shorter, full));
  return merged;
}

bool needs_second_exposure(const LightLevels& levels) {
  constexpr double kClippedMax = 0.05, kFaintMax = 0.125;
  return levels.clipped_share > kClippedMax && levels.lit_faintest < kFaintMax * levels.full;
}

Grey16 as_merged(const GreyView& frame, double full) {
  const auto [width, height] = size_of(frame);
  Grey16 merged(width, height);
  const float scale = scale_to_merged(full);
  const auto convert = [&]<class T>(const ImageView<T>& image) {
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        const T level = image.at(x, y);
        merged.at(x, y) =
            level >= full ? static_cast<std::uint16_t>(kMergedFull) : merged_level(dithered(level, x, y) * scale);
      }
    }
  };
  std::visit(convert, frame);
  return merged;
}

}  // namespace slsd
