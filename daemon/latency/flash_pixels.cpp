// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/latency/flash_pixels.hpp"

#include <algorithm>
#include <cmath>
#include <variant>

namespace slsd {
namespace {

constexpr int kSamplesAcross = 200;
constexpr double kBrightest = 0.99;
constexpr double kChosen = 0.5;    // of the flash's own brightest
constexpr double kAboveNoise = 4;  // times the brightest difference of two dark frames
constexpr double kClipped = 0.985;

double brightest_difference(const std::vector<double>& from, const std::vector<double>& to) {
  std::vector<double> differences(from.size());
  std::ranges::transform(to, from, differences.begin(), [](double b, double a) { return b - a; });
  const auto nth = differences.begin() + static_cast<std::ptrdiff_t>(kBrightest * static_cast<double>(from.size() - 1));
  std::nth_element(differences.begin(), nth, differences.end());
  return *nth;
}

}  // namespace

FlashPixels::Samples FlashPixels::sample(const GreyView& frame) {
  Samples samples;
  std::visit(
      [&](const auto& image) {
        const int step = std::max(1, image.width / kSamplesAcross);
        for (int y = 0; y < image.height; y += step) {
          for (int x = 0; x < image.width; x += step) samples.push_back(image.at(x, y));
        }
      },
      frame);
  return samples;
}

Result<FlashPixels> FlashPixels::find(const Samples& dark, const Samples& dark_again, const Samples& lit) {
  if (dark.empty() || dark.size() != lit.size() || dark.size() != dark_again.size()) {
    return fail(ErrorCode::kMismatch, "the camera's frames are not all of the same size: set its size");
  }
  const double flash = brightest_difference(dark, lit);
  const double noise = std::abs(brightest_difference(dark, dark_again));
  if (flash < kAboveNoise * noise + 1) {
    return fail(ErrorCode::kNotFound,
                "no flash is seen: point the camera at what the projector lights, take the caps off, darken the room, "
                "and allow a longer exposure");
  }
  FlashPixels pixels;
  const double highest = *std::ranges::max_element(lit);
  std::size_t saturated = 0;
  for (std::size_t i = 0; i < dark.size(); ++i) {
    if (lit[i] - dark[i] < kChosen * flash) continue;
    pixels.chosen_.push_back(i);
    pixels.dark_ += dark[i];
    pixels.lit_ += lit[i];
    saturated += lit[i] >= kClipped * highest ? 1 : 0;
  }
  // The highest level of 8, 10, 12 or 16 bits, and of nothing in between.
  const bool at_end = highest >= 255 && std::fmod(std::log2(highest + 1), 1.0) == 0;
  pixels.clipped_ = at_end && 2 * saturated > pixels.chosen_.size();
  return pixels;
}

double FlashPixels::share_of_white(const Samples& frame) const {
  double sum = 0;
  for (const std::size_t i : chosen_) sum += i < frame.size() ? frame[i] : 0;
  return (sum - dark_) / (lit_ - dark_);
}

}  // namespace slsd
