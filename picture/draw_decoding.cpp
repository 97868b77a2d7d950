// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/draw_decoding.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

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
constexpr double kLegiblePitchPx = 20.0;
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
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return std::clamp(*middle, 4.0, 64.0);
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

// Frame pixels to picture pixels, and marks in sizes that suit the pitch.
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
  void undecoded(const RegionSeen& region) {
    canvas_.plus(place(region), 0.27 * pitch_, kUndecodedColour, stroke() + 1);
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

void draw_legend(ColourImage& picture, int top, double text_px, const Decoding& decoding, const Pattern& pattern) {
  std::array<int, kMaxLetters> seen{};
  for (const RegionSeen& region : decoding.regions) {
    const int letter = region.letter;
    if (decoded(region) && letter < kMaxLetters) ++seen[static_cast<std::size_t>(letter)];
  }
  Legend legend(picture, top, text_px);
  for (std::size_t letter = 0; letter < pattern.options.symbols.size() && letter < kMaxLetters; ++letter) {
    const std::string symbol = "symbol " + std::to_string(pattern.options.symbols[letter]) + ": ";
    legend.disc(letter_colour(static_cast<int>(letter)), symbol + std::to_string(seen[letter]));
  }
  for (int status = 1; status < kRegionStatusCount; ++status) {
    const auto reason = static_cast<RegionStatus>(status);
    if (decoding.count(reason) == 0) continue;
    std::string words(to_string(reason));
    std::replace(words.begin(), words.end(), '_', ' ');
    legend.plus(kUndecodedColour, words + ": " + std::to_string(decoding.count(reason)));
  }
  legend.line(kLinkColour, "link");
  legend.dashes(kBrokenLinkColour, "broken link");
}

}  // namespace

Rgb letter_colour(int letter) {
  return kLetterColours[static_cast<std::size_t>(letter) % kLetterColours.size()];
}

ColourImage draw_decoding(const GreyView& frame, const Decoding& decoding, const Pattern& pattern) {
  const double pitch = pitch_px(decoding);
  const int scale = scale_of(frame, pitch);
  const double text_px = std::max(8.0, scale * frame_side_px(frame) / 110.0);
  const int footer_px = static_cast<int>(8.5 * text_px);
  ColourImage picture = dimmed_frame(frame, scale, footer_px);
  Marker marker(picture, scale, pitch);
  draw_links(marker, decoding);
  for (const RegionSeen& region : decoding.regions) {
    if (decoded(region)) {
      marker.symbol(region);
    } else {
      marker.undecoded(region);
    }
  }
  draw_legend(picture, picture.height() - footer_px, text_px, decoding, pattern);
  return picture;
}

}  // namespace slsd
