// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/classify.hpp"

#include <cmath>
#include <cstring>
#include <limits>

#include "core/clones.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

static_assert(kFeatureCount == 8);  // the powers of Student's t
constexpr float kDegreesOfFreedom = 4;
constexpr float kFarthestSquared = 1e5F;  // beyond it all letters are equally unlikely, and floats run out of range

/// Probability that a shape is another letter than the likeliest one, for reasons that the prototypes lack: cut at an
/// edge, split, run together, printed on. It grows with the distance from the nearest prototype. Measured on drawn and
/// rendered frames: see the table in docs/notes/2026-11-decoder.md.
constexpr float kDoubtMin = 0.01F, kDoubtMax = 0.5F;
constexpr float kDoubtFrom = 2, kDoubtSlope = 0.12F;

/// Verdicts on eight shapes.
struct Verdicts {
  Lanes log_probability[kMaxLetters];
  Lanes distance, best;  // from the nearest prototype, and the greatest likelihood
  IntLanes likeliest;    // the letter that has it; -1 where none is likely at all
};

/// Natural logarithms of positive numbers to 1e-6: the exponent's logarithm plus the mantissa's. The mantissa lies
/// within a factor sqrt(2) of one, and its logarithm is the series of 2 artanh.
inline __attribute__((always_inline)) void take_logarithms(const Lanes& of, Lanes& logarithms) {
  constexpr int kRootOfHalf = 0x3F3504F3, kExponentUnit = 1 << 23;
  constexpr float kLogTwo = 0.69314718F;
  const IntLanes bits = reinterpret_cast<IntLanes>(of);
  const IntLanes exponent = (bits - kRootOfHalf) >> 23;
  const Lanes mantissa = reinterpret_cast<Lanes>(bits - exponent * kExponentUnit);
  const Lanes s = (mantissa - 1) / (mantissa + 1), ss = s * s;
  logarithms = __builtin_convertvector(exponent, Lanes) * kLogTwo +
               2 * s * (1 + ss * (1 / 3.F + ss * (1 / 5.F + ss * (1 / 7.F + ss * (1 / 9.F)))));
}

/// Vectors have no square root of their own; the compiler vectorises this loop.
inline __attribute__((always_inline)) void take_roots(const Lanes& of, Lanes& roots) {
  alignas(Lanes) float numbers[kLanes];
  std::memcpy(numbers, &of, sizeof of);
  for (float& number : numbers) number = std::sqrt(number);
  slsd::load(numbers, roots);
}

/// Adds the squares of the whitened features from kRow on. The rows of the triangle differ in length, so a template
/// unrolls them.
template <int kRow>
inline __attribute__((always_inline)) void add_squares(const Classifier::Letter& letter, const Lanes* deviation,
                                                       Lanes& squared_distance) {
  if constexpr (kRow < kFeatureCount) {
    Lanes whitened{};
    for (int j = 0; j <= kRow; ++j) whitened += letter.whitening[kRow][j] * deviation[j];
    squared_distance += whitened * whitened;
    add_squares<kRow + 1>(letter, deviation, squared_distance);
  }
}

inline __attribute__((always_inline)) void find_squared_distance(const Classifier::Letter& letter,
                                                                 const EightShapes& shapes, Lanes& squared_distance) {
  Lanes deviation[kFeatureCount];
  for (int i = 0; i < kFeatureCount; ++i) deviation[i] = shapes.of[i] - letter.mean[i];
  squared_distance = Lanes{};
  add_squares<0>(letter, deviation, squared_distance);
}

inline __attribute__((always_inline)) void judge(std::span<const Classifier::Letter> letters, float share,
                                                 const EightShapes& shapes, Verdicts& verdicts) {
  const Lanes zero{}, farthest = zero + kFarthestSquared;
  Lanes nearest = zero + std::numeric_limits<float>::max(), best{}, sum{}, likelihoods[kMaxLetters];
  IntLanes likeliest = IntLanes{} - 1;
  for (std::size_t i = 0; i < letters.size(); ++i) {
    Lanes squared_distance;
    find_squared_distance(letters[i], shapes, squared_distance);
    nearest = squared_distance < nearest ? squared_distance : nearest;
    // Student's t in eight dimensions: (1 + d^2 / nu)^(-(nu + 8) / 2), nu = 4.
    const Lanes squared = squared_distance < farthest ? squared_distance : farthest;
    const Lanes t = 1 + squared / kDegreesOfFreedom, cubed = t * t * t;
    const Lanes likelihood = letters[i].density / (cubed * cubed);
    likeliest = likelihood > best ? IntLanes{} + static_cast<int>(i) : likeliest;
    best = likelihood > best ? likelihood : best;
    sum += likelihood;
    likelihoods[i] = likelihood;
  }
  take_roots(nearest, verdicts.distance);
  Lanes doubt = kDoubtMin + kDoubtSlope * (verdicts.distance - kDoubtFrom);
  doubt = doubt < kDoubtMin ? zero + kDoubtMin : doubt;
  doubt = doubt > kDoubtMax ? zero + kDoubtMax : doubt;
  const Lanes scale = (1 - doubt) / sum, any = doubt * share;
  for (std::size_t i = 0; i < letters.size(); ++i)
    take_logarithms(likelihoods[i] * scale + any, verdicts.log_probability[i]);
  verdicts.best = best, verdicts.likeliest = likeliest;
}

inline __attribute__((always_inline)) void find_squared_distances(std::span<const Classifier::Letter> letters,
                                                                  const EightShapes& shapes,
                                                                  Classifier::EightDistances& squared) {
  for (std::size_t i = 0; i < letters.size(); ++i) find_squared_distance(letters[i], shapes, squared.of[i]);
}

}  // namespace

Classifier::Classifier(const std::vector<Prototype>& prototypes, float distance_max)
    : share_(1 / static_cast<float>(prototypes.size())), distance_max_(distance_max) {
  for (const Prototype& prototype : prototypes) {
    Letter& letter = letters_.emplace_back();
    letter.density = prototype.density;
    for (int i = 0; i < kFeatureCount; ++i) {
      letter.mean[i] = prototype.mean[i];
      for (int j = 0; j <= i; ++j) letter.whitening[i][j] = prototype.whitening(i, j);
    }
  }
}

void Classifier::classify(const EightShapes& shapes, std::span<Classification> to) const {
  Verdicts verdicts{};
  Cloned<judge>::call(letters_, share_, shapes, verdicts);
  verdicts.likeliest = verdicts.distance <= distance_max_ ? verdicts.likeliest : IntLanes{} - 1;
  for (std::size_t lane = 0; lane < to.size(); ++lane) {
    Classification result;
    for (int i = 0; i < kMaxLetters; ++i) result.log_probability[i] = verdicts.log_probability[i][lane];
    result.distance = verdicts.distance[lane];
    result.likelihood = verdicts.best[lane];
    result.letter = static_cast<std::int8_t>(verdicts.likeliest[lane]);
    to[lane] = result;
  }
}

float Classification::share_of(int of_letter, float even) const {
  const float doubt = std::clamp(kDoubtMin + kDoubtSlope * (distance - kDoubtFrom), kDoubtMin, kDoubtMax);
  const float mixed = std::exp(log_probability[static_cast<std::size_t>(of_letter)]);
  return std::clamp((mixed - doubt * even) / (1 - doubt), 0.F, 1.F);
}

Classification Classification::of_letter(int letter, int letters, float distance) {
  const float even = 1 / static_cast<float>(letters);
  Classification known;
  known.letter = static_cast<std::int8_t>(letter), known.distance = distance, known.likelihood = 1;
  const float doubt = std::clamp(kDoubtMin + kDoubtSlope * (distance - kDoubtFrom), kDoubtMin, kDoubtMax);
  for (int other = 0; other < letters; ++other)
    known.log_probability[static_cast<std::size_t>(other)] = std::log(doubt * even + (other == letter ? 1 - doubt : 0));
  return known;
}

Classification Classifier::classify(const ShapeFeatures& features) const {
  EightShapes one;
  one.set(0, features);
  Classification result;
  classify(one, std::span(&result, 1));
  return result;
}

void Classifier::find_squared_distances(const EightShapes& shapes, EightDistances& squared) const {
  Cloned<slsd::find_squared_distances>::call(letters_, shapes, squared);
}

}  // namespace slsd
