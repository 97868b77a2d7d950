// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/read_border.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "core/decode/grid/neighbourhood.hpp"

namespace slsd {
namespace {

constexpr int kSide = 11, kSamples = kSide * kSide;  // over a symbol's square
constexpr int kVisibleMin = kSamples * 2 / 5;

/// Where a sample lies in the square, projector px from the middle.
Eigen::Vector2f place_of(int sample, float size_px) {
  const Eigen::Vector2f in_square(static_cast<float>(sample % kSide), static_cast<float>(sample / kSide));
  return size_px * ((in_square.array() + 0.5F) / kSide - 0.5F).matrix();
}

/// What is seen of a symbol, and at which samples.
struct Visible {
  std::array<float, kSamples> grey;
  std::array<int, kSamples> sample;
  int count = 0;
};

Visible look_at(const GreyView& frame, const Eigen::Vector2f& centre_px, const LatticeFrame& lattice_frame,
                float size_px) {
  Visible visible;
  const auto look = [&](const auto& image) {
    for (int i = 0; i < kSamples; ++i) {
      const Eigen::Vector2f there = centre_px + lattice_frame * place_of(i, size_px);
      if (!(there.x() >= 0 && there.y() >= 0)) continue;
      if (!(there.x() < static_cast<float>(image.width - 1) && there.y() < static_cast<float>(image.height - 1)))
        continue;
      const int x = static_cast<int>(there.x()), y = static_cast<int>(there.y());
      const double level =
          level_between(image, x, y, there.x() - static_cast<float>(x), there.y() - static_cast<float>(y));
      visible.grey[visible.count] = static_cast<float>(level);
      visible.sample[visible.count++] = i;
    }
  };
  std::visit(look, frame);
  return visible;
}

/// Correlation of what is seen with a letter, which is that of its light and its background whatever they are.
/// @param expected  the letter's, one to a sample
float likeness(const Visible& visible, std::span<const float> expected) {
  float grey = 0, light = 0, grey_squared = 0, light_squared = 0, product = 0;
  for (int i = 0; i < visible.count; ++i) {
    // From a level of its own on: squares of high ones would drown what is between them.
    const float lit = expected[visible.sample[i]], seen = visible.grey[i] - visible.grey[0];
    grey += seen, light += lit;
    grey_squared += seen * seen, light_squared += lit * lit, product += seen * lit;
  }
  const auto count = static_cast<float>(visible.count);
  const float variances = (count * grey_squared - grey * grey) * (count * light_squared - light * light);
  return variances > 0 ? (count * product - grey * light) / std::sqrt(variances) : 0;
}

}  // namespace

bool is_at_border(const Eigen::Vector2f& centre_px, const LatticeFrame& frame, float symbol_size_px,
                  const Eigen::Vector2f& frame_px) {
  constexpr float kBorderPx = 3;  // blur widens what touches it
  const Eigen::Array2f reach = 0.5F * symbol_size_px * frame.cwiseAbs().rowwise().sum().array() + kBorderPx;
  return (centre_px.array() < reach).any() || (centre_px.array() > frame_px.array() - 1 - reach).any();
}

BorderReader::BorderReader(const Pattern& pattern, std::shared_ptr<const LetterFields> letters, Rules rules)
    : array_(pattern.array),
      rules_(rules),
      rows_(pattern.whole_rows()),
      columns_(pattern.whole_columns()),
      pitch_px_(static_cast<float>(pattern.pitch_px())),
      size_px_(static_cast<float>(pattern.options.symbol_size_px)),
      letter_count_(static_cast<int>(pattern.options.symbols.size())),
      letters_(std::move(letters)) {}

/// Whether another letter is much more like what is there than the one that is asked for.
bool BorderReader::shows_another(const GreyView& frame, const Eigen::Vector2f& centre_px,
                                 const LatticeFrame& lattice_frame, int letter) const {
  constexpr float kLike = 0.85F, kLead = 0.25F;
  const Visible visible = look_at(frame, centre_px, lattice_frame, size_px_);
  if (visible.count < kVisibleMin) return false;
  const auto likeness_of = [&](int other) {
    return likeness(visible, std::span(expected_).subspan(static_cast<std::size_t>(other) * kSamples, kSamples));
  };
  const float own = likeness_of(letter);
  if (own + kLead > 1) return false;
  float most = 0;
  for (int other = 0; other < letter_count_; ++other) most = std::max(most, likeness_of(other));
  return most >= kLike && most - own >= kLead;
}

void BorderReader::sample_letters(float blur_px) {
  const PatternField& letters = letters_->at(blur_px);
  expected_.clear();
  for (int letter = 0; letter < letter_count_; ++letter) {
    for (int sample = 0; sample < kSamples; ++sample) {
      const Eigen::Vector2f at = letters_->middle_px(letter) + place_of(sample, size_px_);
      expected_.push_back(letters.at(at.x(), at.y()).value);
    }
  }
}

void BorderReader::refuse(const GreyView& frame, float blur_px, Sightings& seen) {
  refused_.clear();
  sample_letters(blur_px);
  const auto [width, height] = size_of(frame);
  const Eigen::Vector2f frame_px(static_cast<float>(width), static_cast<float>(height));
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto node = static_cast<std::int32_t>(i);
    const CellClaim& claim = seen.claims[i];
    if (claim.status != RegionStatus::kDecoded) continue;
    const GridNode& from = seen.nodes[i];
    if (std::ranges::none_of(from.links, [](std::int32_t other) { return other < 0; })) continue;
    for (const Direction d : kDirections) {
      const CellClaim::Cell cell = claim.cell().beyond(d);
      if (from.links[d] >= 0 || cell.row < 0 || cell.column < 0 || cell.row >= rows_ || cell.column >= columns_)
        continue;
      const std::int32_t behind = decoded_beside(seen.nodes, seen.claims, node, opposite(d));
      const Eigen::Vector2f step_px = behind >= 0 ? (from.centre_px - seen.nodes[behind].centre_px).eval()
                                                  : (pitch_px_ * (from.frame * step(d))).eval();
      const Eigen::Vector2f there_px = from.centre_px + step_px;
      if (!is_at_border(there_px, from.frame, size_px_, frame_px)) continue;
      const bool other = shows_another(frame, there_px, from.frame, array_.at(cell.row, cell.column));
      if (!rules_.apply(DecodeRule::kOtherAtBorder, other)) continue;
      refused_.push_back(node);
      break;
    }
  }
  for (const std::int32_t node : refused_) seen.claims[node].decide(DecodeRule::kOtherAtBorder);
}

}  // namespace slsd
