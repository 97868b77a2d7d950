// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/draw_decoding.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "core/geometry/robust.hpp"
#include "picture/canvas.hpp"
#include "picture/dimmed_frame.hpp"
#include "picture/legend.hpp"

namespace slsd {
namespace {

constexpr std::array<Rgb, kMaxLetters> kLetterColours{{{255, 210, 63},
                                                       {64, 196, 255},
                                                       {92, 224, 128},
                                                       {255, 145, 60},
                                                       {184, 146, 255},
                                                       {240, 240, 240},
                                                       {0, 204, 184},
                                                       {206, 168, 120}}};
constexpr Rgb kRim{12, 14, 18};
constexpr Rgb kSettledColour{96, 108, 126};
constexpr double kLegiblePitchPx = 20.0;
constexpr double kLegibleTextPx = 6.0;
constexpr int kMaxScale = 3;
constexpr int kMaxSidePx = 4096;
constexpr double kDefaultPitchPx = 16.0;

bool decoded(const RegionSeen& region) {
  return region.status == RegionStatus::kDecoded && region.letter >= 0;
}

Eigen::Vector2d centre(const RegionSeen& region) {
  return region.centre_px.cast<double>();
}

// Typical distance of two linked regions, frame px.
double pitch_px(const Decoding& decoding) {
  std::vector<double> lengths;
  for (const RegionSeen& region : decoding.regions) {
    const std::int32_t right = region.links[kRight];
    if (right >= 0) lengths.push_back((centre(decoding.regions[right]) - centre(region)).norm());
  }
  if (lengths.empty()) return kDefaultPitchPx;
  return std::clamp(median_in_place(lengths), 4.0, 64.0);
}

int frame_side_px(const GreyView& frame) {
  return std::visit([](const auto& view) { return std::max(view.width, view.height); }, frame);
}

int scale_of(const GreyView& frame, double pitch) {
  int scale = 1;
  while (scale < kMaxScale && scale * pitch < kLegiblePitchPx && (scale + 1) * frame_side_px(frame) <= kMaxSidePx) {
    ++scale;
  }
  return scale;
}

// Maps frame pixels to picture pixels, and sizes marks by the pitch.
class Marker {
 public:
  Marker(ColourImage& picture, int scale, double pitch) : canvas_(picture), scale_(scale), pitch_(scale * pitch) {}

  void link(const RegionSeen& from, const RegionSeen& to) {
    canvas_.line(place(from), place(to), kLinkColour, stroke());
  }
  void broken_link(const RegionSeen& from, const RegionSeen& to) {
    canvas_.dashes(place(from), place(to), kBrokenLinkColour, stroke() + 1, 0.12 * pitch_);
  }
  void symbol(const RegionSeen& region) {
    canvas_.disc(place(region), 0.2 * pitch_ + 1.0, kRim);
    canvas_.disc(place(region), 0.2 * pitch_, letter_colour(region.letter));
  }
  /// Draws a decoded region that needs no comment.
  void settled(const RegionSeen& region) { canvas_.disc(place(region), 0.12 * pitch_, kSettledColour); }
  void undecoded(const RegionSeen& region) {
    canvas_.plus(place(region), 0.27 * pitch_, kUndecodedColour, stroke() + 1);
  }
  void reason(const RegionSeen& region) {
    canvas_.plus(place(region), 0.27 * pitch_, rule_colour(region.rule), stroke() + 1);
    const double height_px = 0.32 * pitch_;
    if (height_px < kLegibleTextPx) return;
    canvas_.text(place(region) + Eigen::Vector2d(0.08 * pitch_, -0.1 * pitch_), std::to_string(number_of(region.rule)),
                 height_px, rule_colour(region.rule));
  }

 private:
  [[nodiscard]] Eigen::Vector2d place(const RegionSeen& region) const {
    return scale_ * centre(region) + Eigen::Vector2d::Constant(0.5 * (scale_ - 1));
  }
  [[nodiscard]] int stroke() const { return pitch_ > 30 ? 2 : 1; }
  Canvas canvas_;
  int scale_;
  double pitch_;
};

void draw_links(Marker& marker, const Decoding& decoding) {
  const auto& regions = decoding.regions;
  for (const RegionSeen& region : regions) {
    for (std::size_t direction = 0; direction < 4; ++direction) {
      const std::int32_t other = region.links[direction];
      if (other < 0) continue;
      if (region.broken[direction]) {
        marker.broken_link(region, regions[other]);
      } else {
        marker.link(region, regions[other]);
      }
    }
  }
}

bool rejects(const Decoding& decoding, DecodeRule rule) {
  return text_of(rule).kind == RuleKind::kRejects && decoding.rules[static_cast<std::size_t>(rule)] > 0;
}

/// Adds the number of regions that each rule rejected, by the rule's number.
void add_rules(Legend& legend, const Decoding& decoding) {
  legend.disc(kSettledColour, "decoded: " + std::to_string(decoding.count(RegionStatus::kDecoded)));
  for (std::size_t i = 0; i < kDecodeRuleCount; ++i) {
    const DecodeRule rule = decode_rule(i);
    if (!rejects(decoding, rule)) continue;
    std::string words(to_string(rule));
    std::replace(words.begin(), words.end(), '_', ' ');
    legend.plus(rule_colour(rule),
                std::to_string(number_of(rule)) + " " + words + ": " + std::to_string(decoding.rules[i]));
  }
}

void add_statuses(Legend& legend, const Decoding& decoding) {
  for (int status = 1; status < kRegionStatusCount; ++status) {
    const auto reason = static_cast<RegionStatus>(status);
    if (decoding.count(reason) == 0) continue;
    std::string words(to_string(reason));
    std::replace(words.begin(), words.end(), '_', ' ');
    legend.plus(kUndecodedColour, words + ": " + std::to_string(decoding.count(reason)));
  }
}

void draw_legend(ColourImage& picture, int top, double text_px, const Decoding& decoding, const Pattern& pattern,
                 DecodingLook look) {
  Legend legend(picture, top, text_px);
  if (look == DecodingLook::kReasons) return add_rules(legend, decoding);
  std::array<int, kMaxLetters> seen{};
  for (const RegionSeen& region : decoding.regions) {
    const int letter = region.letter;
    if (decoded(region) && letter < kMaxLetters) ++seen[static_cast<std::size_t>(letter)];
  }
  for (std::size_t letter = 0; letter < pattern.options.symbols.size() && letter < kMaxLetters; ++letter) {
    const std::string symbol = "symbol " + std::to_string(pattern.options.symbols[letter]) + ": ";
    legend.disc(letter_colour(static_cast<int>(letter)), symbol + std::to_string(seen[letter]));
  }
  add_statuses(legend, decoding);
  legend.line(kLinkColour, "link");
  legend.dashes(kBrokenLinkColour, "broken link");
}

/// The height of the legend in letter heights.
double footer_lines(const Decoding& decoding, DecodingLook look) {
  constexpr double kUsual = 8.5, kForARule = 0.7;
  double lines = kUsual;
  for (std::size_t i = 0; look == DecodingLook::kReasons && i < kDecodeRuleCount; ++i)
    lines += rejects(decoding, decode_rule(i)) ? kForARule : 0;
  return lines;
}

}  // namespace

Rgb letter_colour(int letter) {
  return kLetterColours[static_cast<std::size_t>(letter) % kLetterColours.size()];
}

/// The colour of a rule, in steps of the golden angle, so that neighbours in the list differ.
Rgb rule_colour(DecodeRule rule) {
  constexpr double kGoldenAngle = 137.508, kThird = 120;
  const double hue = std::fmod(kGoldenAngle * number_of(rule), 360.);
  Rgb colour;
  for (std::size_t i = 0; i < 3; ++i) {
    const double away = std::abs(std::remainder(hue - kThird * static_cast<double>(i), 360.));
    colour[i] = static_cast<std::uint8_t>(std::clamp(90 + 330 * (1 - away / kThird), 70., 255.));
  }
  return colour;
}

ColourImage draw_decoding(const GreyView& frame, const Decoding& decoding, const Pattern& pattern, DecodingLook look) {
  const double pitch = pitch_px(decoding);
  const int scale = scale_of(frame, pitch);
  const double text_px = std::max(8.0, scale * frame_side_px(frame) / 110.0);
  const int footer_px = static_cast<int>(footer_lines(decoding, look) * text_px);
  ColourImage picture = dimmed_frame(frame, scale, footer_px);
  Marker marker(picture, scale, pitch);
  if (look == DecodingLook::kSymbols) draw_links(marker, decoding);
  for (const RegionSeen& region : decoding.regions) {
    if (decoded(region)) {
      look == DecodingLook::kReasons ? marker.settled(region) : marker.symbol(region);
    } else {
      look == DecodingLook::kReasons ? marker.reason(region) : marker.undecoded(region);
    }
  }
  draw_legend(picture, picture.height() - footer_px, text_px, decoding, pattern, look);
  return picture;
}

}  // namespace slsd
