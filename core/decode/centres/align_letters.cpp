// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/align_letters.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "core/code/symbol.hpp"
#include "core/decode/centres/align_symbols.hpp"

namespace slsd {
namespace {

constexpr AlignOptions kAlign;
constexpr int kSteps = 5;
/// A shape's misfit squared says that its centre is off by a hundredth of it, camera px: see CentreJudge.
constexpr float kMisfitSquaredPerPx = 100;

/// One standard deviation of an aligned letter's position, projector px.
float sigma_px(const PatchTask& task) {
  return aligned_sigma_px(task.residual * task.residual * task.variance, task.scatter, task.support);
}

/// Every letter in a square of twice its side.
Grey8 draw_letters(const PatternOptions& pattern) {
  const int size_px = pattern.symbol_size_px, cell_px = 2 * size_px, margin = size_px / 2;
  const int letters = static_cast<int>(pattern.symbols.size());
  Grey8 image(letters * cell_px, cell_px);
  for (int letter = 0; letter < letters; ++letter) {
    const Grey8 symbol = draw_symbol(pattern.symbols[letter], size_px);
    for (int y = 0; y < size_px; ++y) {
      std::uint8_t* row = image.row(margin + y) + letter * cell_px + margin;
      for (int x = 0; x < size_px; ++x) row[x] = symbol.at(x, y) != 0 ? 255 : 0;
    }
  }
  return image;
}

/// @param reach  px from the middle to the square's sides
LightShares shares_of_square(const LetterScene& scene, const AskedLetter& asked, const Eigen::Vector2f& middle_px,
                             int reach) {
  constexpr float kInk = 0.2F;                // smallest share of the unprinted light that print leaves
  constexpr float kDark = 0.4F, kLit = 0.3F;  // shares of the letter's light; of the light around it
  const PatchTask& task = asked.task;
  const PatchState& state = task.state;
  const float limit = kAlign.outlier_sigmas * std::hypot(task.noise, kAlign.misfit_share * state.gain);
  const float usual_gain = asked.place.peak - asked.place.background;
  const Eigen::Vector2i middle = middle_px.array().round().matrix().cast<int>();
  // The letter lies in the plane of the grid around it.
  const Eigen::Vector2f from = projector_offset(task.map, state, {0, 0}),
                        right = projector_offset(task.map, state, {1, 0}) - from,
                        down = projector_offset(task.map, state, {0, 1}) - from,
                        origin = from + task.map.origin_px.cast<float>();
  const auto letter_at = [&](const Eigen::Vector2f& off) {
    const Eigen::Vector2f pixel = origin + off.x() * right + off.y() * down;
    return scene.letters.at(pixel.x(), pixel.y()).value;
  };
  const auto count = [&](const auto& view) {
    int agree = 0, brighter = 0, beside = 0, darkened = 0;
    for (int y = middle.y() - reach; y <= middle.y() + reach; ++y) {
      for (int x = middle.x() - reach; x <= middle.x() + reach; ++x) {
        if (!view.contains(x, y)) continue;
        const Eigen::Vector2f off(static_cast<float>(x - task.x), static_cast<float>(y - task.y));
        const float letter = letter_at(off);
        const float expected = (state.gain + state.gain_x * off.x() + state.gain_y * off.y()) * letter;
        const float light = static_cast<float>(view.at(x, y)) - state.offset;
        agree += std::abs(light - expected) <= limit;
        brighter += light - state.gain > limit;
        beside += light - expected > limit && letter < kDark && light > kLit * usual_gain;
        darkened += expected - light > limit && light > std::max(limit, kInk * expected);
      }
    }
    const auto share = [pixels = (2 * reach + 1) * (2 * reach + 1)](int of_them) {
      return static_cast<float>(of_them) / static_cast<float>(pixels);
    };
    return LightShares{share(agree), share(brighter), share(beside), share(darkened)};
  };
  return std::visit(count, scene.frame);
}

}  // namespace

LetterFields::LetterFields(const PatternOptions& pattern)
    : cell_px_(static_cast<float>(2 * pattern.symbol_size_px)), fields_(draw_letters(pattern)) {}

Eigen::Vector2f LetterFields::middle_px(int letter) const {
  const float middle = 0.5F * (cell_px_ - 1);
  return {static_cast<float>(letter) * cell_px_ + middle, middle};
}

float LightShares::agree_beside_print() const {
  return agree / std::max(1 - darkened, 0.4F);
}

LetterAligner::LetterAligner(const IndexedPattern& indexed, std::shared_ptr<const LetterFields> letters)
    : array_(indexed.array()),
      pitch_px_(static_cast<float>(indexed.pattern().pitch_px())),
      letters_(std::move(letters)) {}

void LetterAligner::ask(const LetterScene& scene, std::int32_t node, const LetterPlace& place) {
  const auto [width, height] = size_of(scene.frame);
  const int x = static_cast<int>(std::lround(place.centre_px.x())),
            y = static_cast<int>(std::lround(place.centre_px.y())),
            reach = static_cast<int>(std::ceil(0.5F * pitch_px_ * place.frame.colwise().norm().maxCoeff()));
  if (x < reach || y < reach || x + reach >= width || y + reach >= height) return;
  const CellClaim& claim = scene.seen.claims[node];
  const Eigen::Vector2f middle = letters_->middle_px(letter_of(claim));
  PatchTask task;
  task.x = x, task.y = y;
  task.noise = scene.noise.at(0.5F * (place.background + place.peak));
  // Start with the light of the neighbours, so that print counts little from the first step on.
  task.state.gain = place.peak - place.background, task.state.offset = place.background;
  // The letter starts in the plane of its place. Depth moves it along the epipolar line; a tilt makes that offset
  // change from pixel to pixel.
  PatchMap& map = task.map;
  map.middle_px = {static_cast<float>(x), static_cast<float>(y)};
  map.origin_px = middle.cast<int>();
  map.along = scene.gate.way_of_line(node, claim.row, claim.column);
  map.shift = {map.along.x(), map.along.y(), 0};
  map.base.setIdentity();
  map.base.topLeftCorner<2, 2>() = place.frame.inverse();
  map.base.topRightCorner<2, 1>() =
      middle - map.origin_px.cast<float>() + map.base.topLeftCorner<2, 2>() * (map.middle_px - place.centre_px);
  asked_.push_back({.node = node, .place = place, .task = task});
}

/// Uses windows inside the cells: light from the neighbours falls farther out.
void LetterAligner::align(const LetterScene& scene) {
  std::array<PatchTask*, kEight> eight;
  for (std::size_t first = 0; first < asked_.size(); first += kEight) {
    const std::size_t count = std::min<std::size_t>(kEight, asked_.size() - first);
    float side_px = std::numeric_limits<float>::max();
    for (std::size_t i = 0; i < count; ++i) {
      eight[i] = &asked_[first + i].task;
      side_px = std::min(side_px, pitch_px_ * asked_[first + i].place.frame.colwise().norm().minCoeff());
    }
    const int window_px = 2 * static_cast<int>(0.5F * side_px) + 1;
    for (int step = 0; step < kSteps; ++step)
      align_eight(scene.frame, scene.full, scene.letters, kAlign, window_px, {eight.data(), count});
  }
  for (AskedLetter& asked : asked_) {
    const PatchTask& task = asked.task;
    const int letter = letter_of(scene.seen.claims[asked.node]);
    const Eigen::Vector2f middle = letters_->middle_px(letter) - task.map.origin_px.cast<float>();
    const auto seen_at = [&](const Eigen::Vector2f& off) -> Eigen::Vector2f {
      return task.map.middle_px + camera_offset(task.map, task.state, off);
    };
    asked.centre_px = seen_at(middle);
    asked.centroid_px = seen_at(middle + scene.prototypes[letter].centroid_px);
    const Eigen::RowVector2f slopes(task.state.slope_x, task.state.slope_y);
    asked.tilt_px = 0.5F * pitch_px_ * (slopes * asked.place.frame).norm();
  }
}

LightShares LetterAligner::shares_of_middle(const LetterScene& scene, const AskedLetter& asked) const {
  constexpr int kReachPx = 2;
  return shares_of_square(scene, asked, asked.centre_px, kReachPx);
}

LightShares LetterAligner::shares_of_cell(const LetterScene& scene, const AskedLetter& asked) const {
  const int reach = static_cast<int>(0.5F * pitch_px_ * asked.place.frame.colwise().norm().minCoeff());
  return shares_of_square(scene, asked, asked.task.map.middle_px, reach);
}

bool LetterAligner::shows_other_light(const LetterScene& scene, const AskedLetter& asked) const {
  constexpr float kOfCell = 0.06F;
  return !asked.task.failed && shares_of_cell(scene, asked).beside >= kOfCell;
}

float LetterAligner::support_beside_print(const LetterScene& scene, const AskedLetter& asked) const {
  return std::max(asked.task.support, shares_of_cell(scene, asked).agree_beside_print());
}

void LetterAligner::take_over(const LetterScene& scene, const AskedLetter& asked) const {
  const auto& [node, place, task, centre_px, centroid_px, tilt_px] = asked;
  Sightings& seen = scene.seen;
  seen.nodes[node].centre_px = centre_px;
  seen.nodes[node].frame = place.frame;
  GreyMoments& moments = seen.moments[node];
  moments.x = centroid_px.x(), moments.y = centroid_px.y();
  moments.background = task.state.offset, moments.peak = task.state.offset + task.state.gain;
  const float camera_px = std::sqrt(std::abs(place.frame.determinant()));
  seen.misfits[node] = std::sqrt(kMisfitSquaredPerPx * sigma_px(task) * camera_px);
  seen.claims[node].decide(DecodeRule::kRecovered);
  // Near an edge in depth, the visible part of a symbol may fit the letter of either side.
  constexpr float kDistanceWhole = 2.5F, kDistanceAtEdge = 4;
  const bool at_edge = shows_other_light(scene, asked) || support_beside_print(scene, asked) < kWholeBesidePrintMin;
  seen.aligned[node] = at_edge ? Aligned::kAtEdge : Aligned::kWhole;
  seen.nodes[node].split = at_edge;
  seen.shapes[node] = Classification::of_letter(letter_of(seen.claims[node]), array_->letters,
                                                at_edge ? kDistanceAtEdge : kDistanceWhole);
}

}  // namespace slsd
