// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/divide_light.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "core/exposure/frame_noise.hpp"
#include "core/exposure/light_levels.hpp"
#include "core/image_size.hpp"

namespace slsd {
namespace {

/// Limits of usable light: as a share of the white image's brightest, in standard deviations of its noise, and in
/// levels.
constexpr float kFaintShare = 0.02F, kFaintSigma = 4, kFaintLevels = 2;

float full_of(const GreyView& image) {
  return image.index() == 0 ? std::numeric_limits<std::uint8_t>::max() : std::numeric_limits<std::uint16_t>::max();
}

void copy_row(const GreyView& image, int y, float scale, std::vector<float>& row) {
  std::visit(
      [&](const auto& view) {
        row.resize(view.width);
        for (int x = 0; x < view.width; ++x) row[x] = scale * static_cast<float>(view.row(y)[x]);
      },
      image);
}

float brightest(const GreyView& image) {
  return std::visit(
      [](const auto& view) {
        float most = 0;
        for (int y = 0; y < view.height; ++y) {
          if (view.width > 0) most = std::max<float>(most, *std::max_element(view.row(y), view.row(y) + view.width));
        }
        return most;
      },
      image);
}

/// Images of one camera have the same bit depth; if not, scale by their full levels.
float scale_between(const GreyView& white, const GreyView& other) {
  return full_of(white) / full_of(other);
}

constexpr std::size_t kBins = 32;
constexpr std::size_t kBinLeast = 200;            // pixels
constexpr double kPixelsLookedAt = 2e6;           // more add no information
constexpr double kDarkFrom = 0.1, kDarkTo = 0.3;  // of a bin's pixels, sorted by level: those between the symbols
constexpr double kRoomMax = 0.8;                  // of white

/// The mean level between the symbols. Reorders the levels.
double dark_of(std::vector<float>& levels) {
  std::ranges::sort(levels);
  const auto first = static_cast<std::size_t>(kDarkFrom * static_cast<double>(levels.size()));
  const auto last = static_cast<std::size_t>(kDarkTo * static_cast<double>(levels.size()));
  return std::accumulate(levels.begin() + static_cast<std::ptrdiff_t>(first),
                         levels.begin() + static_cast<std::ptrdiff_t>(last), 0.0) /
         static_cast<double>(last - first);
}

/// The level of a pixel without light. Between the symbols, a constant share of the white light remains, from the room
/// and from scatter, on ink as on paper. So the dark level is a line over the white level, and the black level is its
/// point where both are equal.
double find_black_level(const GreyView& pattern, const GreyView& white,
                        const std::function<bool(int x, int y)>& contains) {
  const auto [width, height] = size_of(white);
  const float most = brightest(white), full = static_cast<float>(guess_full_level(white));
  const int step = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(width) * height / kPixelsLookedAt)));
  std::array<std::vector<float>, kBins> bins;  // the pattern's levels, grouped by the white levels
  std::array<double, kBins> white_sums{};
  std::vector<float> lit, light;
  for (int y = 0; y < height; y += step) {
    copy_row(pattern, y, scale_between(white, pattern), lit);
    copy_row(white, y, 1, light);
    for (int x = 0; x < width; x += step) {
      if (light[x] >= full || !contains(x, y)) continue;
      const std::size_t bin = std::min(kBins - 1, static_cast<std::size_t>(kBins * light[x] / (most + 1)));
      bins[bin].push_back(lit[x]), white_sums[bin] += light[x];
    }
  }
  // Fit a line of dark over white, each bin weighted by its pixels.
  double count = 0, sum_white = 0, sum_dark = 0, white_white = 0, white_dark = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < kBins; ++i) {
    if (bins[i].size() < kBinLeast) continue;
    const auto pixels = static_cast<double>(bins[i].size());
    const double at = white_sums[i] / pixels, dark = dark_of(bins[i]);
    count += pixels, sum_white += pixels * at, sum_dark += pixels * dark;
    white_white += pixels * at * at, white_dark += pixels * at * dark;
    least = std::min(least, dark);
  }
  const double spread = count * white_white - sum_white * sum_white;
  if (!(spread > 0)) return 0;
  const double slope = (count * white_dark - sum_white * sum_dark) / spread;
  if (!(slope < kRoomMax)) return 0;
  // Without light, dark equals white.
  return std::clamp((sum_dark - slope * sum_white) / count / (1 - slope), 0.0, least);
}

Result<> check_sizes(const GreyView& pattern, const GreyView& white, const std::optional<GreyView>& dark) {
  const auto [width, height] = size_of(white);
  for (const auto& [name, other] : {std::pair("pattern's", std::optional(pattern)), std::pair("black", dark)}) {
    if (!other || size_of(*other) == size_of(white)) continue;
    const auto [other_width, other_height] = size_of(*other);
    return fail(ErrorCode::kMismatch, std::string("the ") + name + " image has " +
                                          size_text(other_width, other_height) + " pixels, the white one " +
                                          size_text(width, height) + "; take all with one camera in one mode");
  }
  return {};
}

/// Smallest usable light, in levels of the white image.
float faint_light(const GreyView& white, const FrameNoise& noise) {
  return std::max({kFaintLevels, kFaintShare * brightest(white), kFaintSigma * noise.at(0)});
}

/// The noise of the quotient at the 25th percentile of the surface's levels.
FrameNoise noise_on_ink(const GreyView& white, const FrameNoise& noise, const PrintedSurface& surface, double black,
                        float faint) {
  constexpr double kInk = 0.25;
  constexpr float kOfBoth = 1.414F;  // the noise of the pattern's image and that of the white one, on lit pixels
  constexpr float kReadable = 0.1F;  // of white: noisier symbols are lost, and would cost symbols on paper
  const auto [width, height] = size_of(white);
  const int step = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(width) * height / kPixelsLookedAt)));
  std::vector<float> levels, light;
  for (int y = 0; y < height; y += step) {
    copy_row(white, y, 1, light);
    for (int x = 0; x < width; x += step) {
      if (surface.contains(x, y)) levels.push_back(light[x]);
    }
  }
  if (levels.empty()) return {};
  const auto ink = levels.begin() + static_cast<std::ptrdiff_t>(kInk * static_cast<double>(levels.size()));
  std::ranges::nth_element(levels, ink);
  const float share = kOfBoth * noise.at(*ink) / std::max(faint, *ink - static_cast<float>(black));
  return FrameNoise{1, 0}.scaled(static_cast<float>(kAsBrightAsWhite) * std::min(share, kReadable));
}

/// Exact above the faint level; below it, the quotient falls with the light.
float share_of(float lit, float light, float faint) {
  return light >= faint ? lit / light : lit * std::max(0.F, light) / (faint * faint);
}

std::uint16_t level_of(float share) {
  return static_cast<std::uint16_t>(
      std::clamp(static_cast<float>(kAsBrightAsWhite) * share, 0.F, static_cast<float>(kQuotientFull)));
}

/// A row of the white image above the black level, and the pattern's share of it.
struct DividedRow {
  std::vector<float> light, share;
};

/// Error of a pixel's quotient that blur causes along one axis. Blur takes light from farther towards the brighter
/// side, by the variance times the relative slope of the light. Slopes are half the differences of the neighbours.
float moved_back(float variance, float light, float light_before, float light_after, float before, float after,
                 float faint) {
  if (light_before < faint || light_after < faint) return 0;
  const float limit = 2 * std::sqrt(variance);
  const float farther = std::clamp(variance * 0.5F * (light_after - light_before) / light, -limit, limit);
  return farther * 0.5F * (after - before);
}

}  // namespace

Result<Grey16> divide_light(const GreyView& pattern, const GreyView& white, const std::optional<GreyView>& dark) {
  if (auto fit = check_sizes(pattern, white, dark); !fit) return tl::unexpected(fit.error());
  const auto [width, height] = size_of(white);
  const float faint = faint_light(white, measure_noise(white, guess_full_level(white)));
  Grey16 quotient(width, height);
  std::vector<float> lit, light, room(width, 0.F);
  for (int y = 0; y < height; ++y) {
    copy_row(pattern, y, scale_between(white, pattern), lit);
    copy_row(white, y, 1, light);
    if (dark) copy_row(*dark, y, scale_between(white, *dark), room);
    std::uint16_t* const row = quotient.row(y);
    for (int x = 0; x < width; ++x) {
      row[x] = level_of(share_of(std::max(0.F, lit[x] - room[x]), light[x] - room[x], faint));
    }
  }
  return quotient;
}

Result<DividedPrint> divide_light(const GreyView& pattern, const GreyView& white, const PrintedSurface& surface) {
  if (auto fit = check_sizes(pattern, white, std::nullopt); !fit) return tl::unexpected(fit.error());
  const int width = size_of(white).first, height = size_of(white).second;
  const FrameNoise noise = measure_noise(white, guess_full_level(white));
  const float faint = faint_light(white, noise);
  const auto black = static_cast<float>(find_black_level(pattern, white, surface.contains));
  const auto variance = static_cast<float>(surface.blur_px * surface.blur_px);
  std::array<DividedRow, 3> rows;  // row y is at y % 3
  const auto divide_row = [&](int y) {
    DividedRow& row = rows[y % 3];
    copy_row(pattern, y, scale_between(white, pattern), row.share);
    copy_row(white, y, 1, row.light);
    for (int x = 0; x < width; ++x) {
      row.light[x] -= black;
      row.share[x] = share_of(std::max(0.F, row.share[x] - black), row.light[x], faint);
    }
  };
  Grey16 quotient(width, height);
  for (int y = 0; y < height; ++y) {
    if (y == 0) divide_row(0);
    if (y + 1 < height) divide_row(y + 1);
    const DividedRow &here = rows[y % 3], &above = rows[(y + 2) % 3], &below = rows[(y + 1) % 3];
    const bool inner_row = y > 0 && y + 1 < height;
    for (int x = 0; x < width; ++x) {
      float share = here.share[x];
      if (inner_row && x > 0 && x + 1 < width && here.light[x] >= faint) {
        share -=
            moved_back(variance, here.light[x], here.light[x - 1], here.light[x + 1], here.share[x - 1],
                       here.share[x + 1], faint) +
            moved_back(variance, here.light[x], above.light[x], below.light[x], above.share[x], below.share[x], faint);
      }
      quotient.row(y)[x] = level_of(share);
    }
  }
  return DividedPrint{std::move(quotient), noise_on_ink(white, noise, surface, black, faint)};
}

}  // namespace slsd
