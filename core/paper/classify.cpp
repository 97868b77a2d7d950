// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/paper/classify.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/code/symbol.hpp"

namespace slsd {
namespace {

using std::numbers::pi;

// Smallest difference in a descriptor that separates two symbols: about the effect of blur and of the pixel grid.
constexpr ComparedDescriptors kSeparation{0.15, 0.3, 0.2, 0.15, 1.0, 0.15, 0.15, 0.05, 0.5};
constexpr double kSeparationRad = pi / 8;

struct Drawn {
  Descriptors shape;
  ComparedDescriptors values;
  bool carries_direction;
};

Drawn draw(int number, int size_px) {
  const Descriptors shape = describe_shape(draw_symbol(number, size_px));
  return {shape, compared(shape, size_px), symbol(number).carries_direction};
}

// Between two directions, which are equal modulo pi.
double angle_between(double a, double b) {
  return std::abs(std::remainder(a - b, pi));
}

bool differ_in_direction(const Drawn& a, const Drawn& b) {
  return a.carries_direction && b.carries_direction &&
         angle_between(a.shape.orientation_rad, b.shape.orientation_rad) > kSeparationRad;
}

bool are_distinct(const Drawn& a, const Drawn& b) {
  for (std::size_t i = 0; i < kComparedCount; ++i) {
    if (std::abs(a.values[i] - b.values[i]) > kSeparation[i]) return true;
  }
  return differ_in_direction(a, b);
}

void limit(LetterThresholds& letter, const Drawn& own, const Drawn& other) {
  for (std::size_t i = 0; i < kComparedCount; ++i) {
    const double midway = (own.values[i] + other.values[i]) / 2;
    LetterThresholds::Interval& interval = letter.intervals[i];
    if (other.values[i] < own.values[i] - kSeparation[i]) interval.low = std::max(interval.low, midway);
    if (other.values[i] > own.values[i] + kSeparation[i]) interval.high = std::min(interval.high, midway);
  }
  if (!differ_in_direction(own, other)) return;
  const double midway = angle_between(own.shape.orientation_rad, other.shape.orientation_rad) / 2;
  letter.orientation_margin_rad = std::min(letter.orientation_margin_rad, midway);
}

bool holds(const LetterThresholds& letter, const ComparedDescriptors& values, double orientation_rad) {
  for (std::size_t i = 0; i < kComparedCount; ++i) {
    if (values[i] < letter.intervals[i].low || values[i] > letter.intervals[i].high) return false;
  }
  return angle_between(orientation_rad, letter.orientation_rad) <= letter.orientation_margin_rad;
}

}  // namespace

ComparedDescriptors compared(const Descriptors& shape, double side_px) {
  return {shape.rectangularity,
          shape.eccentricity,
          shape.aspect_ratio,
          shape.convex_to_area,
          shape.perimeter_to_area * shape.equivalent_diameter_px,
          shape.area_px / (side_px * side_px),
          shape.equivalent_diameter_px / side_px,
          shape.filled_area_ratio,
          static_cast<double>(shape.euler_number)};
}

Result<std::vector<LetterThresholds>> make_thresholds(std::span<const int> symbols, int size_px) {
  std::vector<Drawn> drawn;
  for (const int number : symbols) drawn.push_back(draw(number, size_px));
  std::vector<LetterThresholds> letters;
  for (std::size_t own = 0; own < drawn.size(); ++own) {
    LetterThresholds letter{{}, drawn[own].shape.orientation_rad, pi};
    for (std::size_t other = 0; other < drawn.size(); ++other) {
      if (other == own) continue;
      if (!are_distinct(drawn[own], drawn[other])) {
        return fail(ErrorCode::kUnsupported, "symbols " + std::to_string(symbols[own]) + " and " +
                                                 std::to_string(symbols[other]) +
                                                 " have the same shape descriptors; choose others, or leave "
                                                 "decode.classify at its default");
      }
      limit(letter, drawn[own], drawn[other]);
    }
    letters.push_back(letter);
  }
  return letters;
}

int classify_paper(const Descriptors& shape, std::span<const LetterThresholds> letters, double side_px) {
  const ComparedDescriptors values = compared(shape, side_px);
  int found = -1;
  for (std::size_t letter = 0; letter < letters.size(); ++letter) {
    if (!holds(letters[letter], values, shape.orientation_rad)) continue;
    if (found >= 0) return -1;
    found = static_cast<int>(letter);
  }
  return found;
}

}  // namespace slsd
