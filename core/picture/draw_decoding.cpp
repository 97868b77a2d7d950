// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/picture/draw_decoding.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "core/picture/canvas.hpp"
#include "core/picture/dimmed_frame.hpp"

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
constexpr Rgb kInk{222, 228, 238};
constexpr Rgb kSoftInk{150, 158, 174};
constexpr Rgb kRim{12, 14, 18};
constexpr double kLegiblePitch_px = 20.0;
constexpr int kMaxScale = 3;
constexpr int kMaxSide_px = 4096;
constexpr double kDefaultPitch_px = 16.0;

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
  if (lengths.empty()) return kDefaultPitch_px;
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return std::clamp(*middle, 4.0, 64.0);
}

int frame_side_px(const GreyView& frame) {
  return std::visit([](const auto& view) { return std::max(view.width, view.height); }, frame);
}

int scale_of(const GreyView& frame, double pitch) {
  int scale = 1;
  while (scale < kMaxScale && scale * pitch < kLegiblePitch_px && (scale + 1) * frame_side_px(frame) <= kMaxSide_px) {
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

// Words one after the other in the footer, each behind its mark.
class Legend {
 public:
  Legend(ColourImage& picture, int top, double text_px)
      : canvas_(picture), text_px_(text_px), width_(picture.width()), place_(text_px, top + 2 * text_px) {}

  void symbol(int letter, const std::string& words) {
    begin(words);
    canvas_.disc(mark(), 0.55 * text_px_, letter_colour(letter));
    write(words);
  }
  void undecoded(const std::string& words) {
    begin(words);
    canvas_.plus(mark(), 0.6 * text_px_, kUndecodedColour, 2);
    write(words);
  }
  void line(Rgb colour, bool dashed, const std::string& words) {
    begin(words);
    const Eigen::Vector2d half(0.7 * text_px_, 0);
    canvas_.dashes(mark() - half, mark() + half, colour, 2, dashed ? 0.35 * text_px_ : 2 * text_px_);
    write(words);
  }

 private:
  [[nodiscard]] double width_of(const std::string& words) const {
    return Canvas::text_width_px(words, text_px_) + 4.0 * text_px_;
  }
  void begin(const std::string& words) {
    if (place_.x() + width_of(words) <= width_ || place_.x() == text_px_) return;
    place_ = {text_px_, place_.y() + 2.2 * text_px_};
  }
  [[nodiscard]] Eigen::Vector2d mark() const { return place_ + Eigen::Vector2d(0.7 * text_px_, -0.5 * text_px_); }
  void write(const std::string& words) {
    canvas_.text(place_ + Eigen::Vector2d(1.9 * text_px_, 0), words, text_px_, kInk);
    place_.x() += width_of(words);
  }
  Canvas canvas_;
  double text_px_;
  double width_;
  Eigen::Vector2d place_;
};

void draw_legend(ColourImage& picture, int top, double text_px, const Decoding& decoding, const Pattern& pattern) {
  std::array<int, kMaxLetters> seen{};
  for (const RegionSeen& region : decoding.regions) {
    if (decoded(region) && region.letter < kMaxLetters) ++seen[static_cast<std::size_t>(region.letter)];
  }
  Legend legend(picture, top, text_px);
  for (std::size_t letter = 0; letter < pattern.options.symbols.size() && letter < kMaxLetters; ++letter) {
    const int number = pattern.options.symbols[letter];
    legend.symbol(static_cast<int>(letter), "symbol " + std::to_string(number) + ": " + std::to_string(seen[letter]));
  }
  for (int status = 1; status < kRegionStatusCount; ++status) {
    const auto reason = static_cast<RegionStatus>(status);
    if (decoding.count(reason) == 0) continue;
    std::string words(to_string(reason));
    std::replace(words.begin(), words.end(), '_', ' ');
    legend.undecoded(words + ": " + std::to_string(decoding.count(reason)));
  }
  legend.line(kLinkColour, false, "link");
  legend.line(kBrokenLinkColour, true, "broken link");
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
