// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/mend_symbols.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "core/code/symbol.hpp"
#include "core/decode/grid/neighbourhood.hpp"

namespace slsd {
namespace {

constexpr AlignOptions kAlign;
constexpr int kSteps = 5;
constexpr float kSettledPx = 0.05F;
/// The share of a patch that agrees with its letter, below which it is not there, and that which noise alone leaves.
constexpr float kSupportMin = 0.55F, kSupportUsual = 0.95F;
constexpr float kAcrossMaxPx = 0.4F;  // off the epipolar line, projector px
constexpr float kMovedMax = 0.1F;     // from where the neighbours put it, of the pitch
constexpr int kHeldBy = 2;
/// From which misfit on what is decoded is aligned, too: whole symbols are nearer to their letters. Its centroid is
/// given up where the patch agrees well and lies near it; farther off, what was seen is another part of the symbol.
constexpr float kDoubtfulMisfit = 2.5F, kSupportGood = 0.65F, kNear = 0.08F;
/// What the place is off by, projector px: as for every symbol that is aligned, see align_symbols.cpp.
constexpr float kOfVariance = 1.1F, kOfLack = 0.11F, kOfScatter = 1.2F;
/// A shape's misfit squared says that its centre is off by a hundredth of it, camera px: see CentreJudge.
constexpr float kMisfitSquaredPerPx = 100;

/// One standard deviation of an aligned letter's place, projector px.
float sigma_px(const PatchTask& task) {
  const auto square = [](float x) { return x * x; };
  return std::sqrt(square(kOfVariance * task.residual) * task.variance +
                   square(kOfLack * std::max(0.F, kSupportUsual - task.support)) + square(kOfScatter * task.scatter));
}

bool is_worn(const Sightings& seen, std::int32_t node) {
  const CellClaim& claim = seen.claims[node];
  if (claim.island < 0) return false;
  return claim.status == RegionStatus::kDamagedShape || claim.status == RegionStatus::kOffEpipolarLine ||
         (claim.status == RegionStatus::kDecoded && seen.misfits[node] > kDoubtfulMisfit);
}

/// The neighbour along a direction, if it is decoded, of the same island and of the cell beside; -1 otherwise.
std::int32_t holder(const Sightings& seen, std::int32_t node, Direction d) {
  const std::int32_t other = neighbour(seen.nodes, node, d);
  if (other < 0) return -1;
  const CellClaim &claim = seen.claims[node], &held_by = seen.claims[other];
  const bool holds =
      held_by.status == RegionStatus::kDecoded && held_by.island == claim.island && claim.fits(held_by, d);
  return holds ? other : -1;
}

}  // namespace

LetterFields::LetterFields(const PatternOptions& pattern)
    : symbol_size_px_(pattern.symbol_size_px), cell_px_(2 * pattern.symbol_size_px) {
  const int letters = static_cast<int>(pattern.symbols.size()), margin = symbol_size_px_ / 2;
  Grey8 image(letters * cell_px_, cell_px_);
  for (int letter = 0; letter < letters; ++letter) {
    const Grey8 symbol = draw_symbol(pattern.symbols[letter], symbol_size_px_);
    for (int y = 0; y < symbol_size_px_; ++y) {
      std::uint8_t* row = image.row(margin + y) + letter * cell_px_ + margin;
      for (int x = 0; x < symbol_size_px_; ++x) row[x] = symbol.at(x, y) != 0 ? 255 : 0;
    }
  }
  for (const float blur_px : kBlursPx) fields_.emplace_back(image.view(), blur_px);
}

const PatternField& LetterFields::at(float blur_px) const {
  const auto off = [&](float known) { return std::abs(known - blur_px); };
  return fields_[static_cast<std::size_t>(std::ranges::min_element(kBlursPx, {}, off) - kBlursPx.begin())];
}

Eigen::Vector2f LetterFields::middle_px(int letter) const {
  const float middle = 0.5F * static_cast<float>(cell_px_ - 1);
  return {static_cast<float>(letter * cell_px_) + middle, middle};
}

SymbolMender::SymbolMender(const Pattern& pattern)
    : array_(pattern.array),
      pitch_px_(static_cast<float>(pattern.pitch_px())),
      letters_(std::make_shared<const LetterFields>(pattern.options)) {}

/// Between those on both sides of it, or one step on from two in a line; the mean.
SymbolMender::Place SymbolMender::place_by_neighbours(const Sightings& seen, std::int32_t node) const {
  Place place{Eigen::Vector2f::Zero(), LatticeFrame::Zero(), 0, 0, 0};
  float count = 0;
  for (const Direction d : kDirections) {
    const std::int32_t beside = holder(seen, node, d);
    if (beside < 0) continue;
    ++place.held_by;
    const GreyMoments& light = seen.moments[beside];
    place.frame += seen.nodes[beside].frame, place.background += light.background, place.peak += light.peak;
    const Eigen::Vector2f& centre = seen.nodes[beside].centre_px;
    const std::int32_t behind = holder(seen, node, opposite(d)), next = holder(seen, beside, d);
    if (behind >= 0) {
      place.centre_px += 0.5F * (centre + seen.nodes[behind].centre_px), ++count;
    } else if (next >= 0) {
      place.centre_px += 2 * centre - seen.nodes[next].centre_px, ++count;
    }
  }
  if (count == 0) return {.held_by = 0};
  const auto held_by = static_cast<float>(place.held_by);
  return {place.centre_px / count, place.frame / held_by, place.background / held_by, place.peak / held_by,
          place.held_by};
}

/// Sets up the task of a node that enough hold; its window lies within the frame.
void SymbolMender::look_at(const GreyView& frame, const FrameNoise& noise, const CellGate& gate, const Sightings& seen,
                           std::int32_t node) {
  const Place place = place_by_neighbours(seen, node);
  if (place.held_by < kHeldBy) return;
  const auto [width, height] = std::visit([](const auto& view) { return std::pair(view.width, view.height); }, frame);
  const int x = static_cast<int>(std::lround(place.centre_px.x())),
            y = static_cast<int>(std::lround(place.centre_px.y())),
            reach = static_cast<int>(std::ceil(0.5F * pitch_px_ * place.frame.colwise().norm().maxCoeff()));
  if (x < reach || y < reach || x + reach >= width || y + reach >= height) return;
  const CellClaim& claim = seen.claims[node];
  const Eigen::Vector2f middle = letters_->middle_px(array_.at(claim.row, claim.column));
  PatchTask task{.x = x, .y = y, .noise = noise.at(0.5F * (place.background + place.peak))};
  // The light around it to begin with, so that what is printed there counts little from the first step on.
  task.state.gain = place.peak - place.background, task.state.offset = place.background;
  // The letter lies as the neighbours do; what depth moves it by is an offset along the epipolar line, which a tilt
  // makes another from pixel to pixel.
  PatchMap& map = task.map;
  map.middle_px = {static_cast<float>(x), static_cast<float>(y)};
  map.origin_px = middle.cast<int>();
  map.along = gate.way_of_line(node, claim.row, claim.column);
  map.shift = {map.along.x(), map.along.y(), 0};
  map.base.setIdentity();
  map.base.topLeftCorner<2, 2>() = place.frame.inverse();
  map.base.topRightCorner<2, 1>() =
      middle - map.origin_px.cast<float>() + map.base.topLeftCorner<2, 2>() * (map.middle_px - place.centre_px);
  map.reference_inverse_depth = 0, map.inverse_depth_per_px = 1;
  asked_.push_back(node), places_.push_back(place), tasks_.push_back(task);
}

/// Eight at a time, in windows that lie within their cells: beyond is what neighbours light.
void SymbolMender::align(const GreyView& frame, double full, const PatternField& field) {
  std::array<PatchTask*, kEight> eight;
  for (std::size_t first = 0; first < tasks_.size(); first += kEight) {
    const std::size_t count = std::min<std::size_t>(kEight, tasks_.size() - first);
    float side_px = std::numeric_limits<float>::max();
    for (std::size_t i = 0; i < count; ++i) {
      eight[i] = &tasks_[first + i];
      side_px = std::min(side_px, pitch_px_ * places_[first + i].frame.colwise().norm().minCoeff());
    }
    const int window_px = 2 * static_cast<int>(0.5F * side_px) + 1;
    for (int step = 0; step < kSteps; ++step) align_eight(frame, full, field, kAlign, window_px, {eight.data(), count});
  }
}

/// Where the middle of the letter's square is seen.
Eigen::Vector2f SymbolMender::centre_of(const PatchTask& task, int letter) const {
  const Eigen::Vector2f middle = letters_->middle_px(letter) - task.map.origin_px.cast<float>();
  return task.map.middle_px + camera_offset(task.map, task.state, middle);
}

/// Whether the pixels around the centre agree with the letter: where another surface hides it, the camera does not see
/// the point.
bool SymbolMender::shows_centre(const GreyView& frame, const PatternField& field, const PatchTask& task,
                                int letter) const {
  constexpr int kReach = 2, kAgreeMin = 17;  // of 25
  const PatchState& state = task.state;
  const float limit = kAlign.outlier_sigmas * std::hypot(task.noise, kAlign.misfit_share * state.gain);
  const Eigen::Vector2i at = centre_of(task, letter).array().round().matrix().cast<int>();
  int agree = 0;
  for (int y = at.y() - kReach; y <= at.y() + kReach; ++y) {
    for (int x = at.x() - kReach; x <= at.x() + kReach; ++x) {
      const float dx = static_cast<float>(x - task.x), dy = static_cast<float>(y - task.y);
      const Eigen::Vector2f across(-task.map.along.y(), task.map.along.x());
      const Eigen::Vector2f pixel = task.map.base.topRows<2>() * Eigen::Vector3f(dx, dy, 1) +
                                    task.map.along * (state.disparity + state.slope_x * dx + state.slope_y * dy) +
                                    across * state.across + task.map.origin_px.cast<float>();
      const float light = state.gain + state.gain_x * dx + state.gain_y * dy;
      const float expected = state.offset + light * field.at(pixel.x(), pixel.y()).value;
      agree += std::visit(
          [&](const auto& view) {
            return view.contains(x, y) && std::abs(static_cast<float>(view.at(x, y)) - expected) <= limit;
          },
          frame);
    }
  }
  return agree >= kAgreeMin;
}

bool SymbolMender::is_there(const PatchTask& task, const Sightings& seen, std::int32_t node) const {
  if (task.failed || task.support < kSupportMin || std::abs(task.moved) > kSettledPx) return false;
  if (std::abs(task.state.across) > kAcrossMaxPx || std::abs(task.state.disparity) > kMovedMax * pitch_px_)
    return false;
  const CellClaim& claim = seen.claims[node];
  const Eigen::Vector2f centre = centre_of(task, array_.at(claim.row, claim.column));
  // What is tilted out of all proportion lies anywhere.
  if (!((centre - task.map.middle_px).norm() < 0.5F * pitch_px_)) return false;
  if (claim.status != RegionStatus::kDecoded) return true;
  const Eigen::Vector2f moved_px = centre - seen.nodes[node].centre_px;
  return task.support >= kSupportGood && (seen.nodes[node].frame.inverse() * moved_px).norm() < kNear * pitch_px_;
}

void SymbolMender::take_over(const PatchTask& task, const LatticeFrame& lattice_frame,
                             std::span<const Prototype> prototypes, Sightings& seen, std::int32_t node) const {
  CellClaim& claim = seen.claims[node];
  const int letter = array_.at(claim.row, claim.column);
  seen.nodes[node].centre_px = centre_of(task, letter);
  seen.nodes[node].frame = lattice_frame;
  const Eigen::Vector2f centroid =
      letters_->middle_px(letter) + prototypes[letter].centroid_px - task.map.origin_px.cast<float>();
  const Eigen::Vector2f centre = task.map.middle_px + camera_offset(task.map, task.state, centroid);
  GreyMoments& moments = seen.moments[node];
  moments.x = centre.x(), moments.y = centre.y();
  moments.background = task.state.offset, moments.peak = task.state.offset + task.state.gain;
  const float camera_px = std::sqrt(std::abs(lattice_frame.determinant()));
  seen.misfits[node] = std::sqrt(kMisfitSquaredPerPx * sigma_px(task) * camera_px);
  claim.status = RegionStatus::kDecoded;
}

const std::vector<std::int32_t>& SymbolMender::mend(const GreyView& frame, double full, const FrameNoise& noise,
                                                    float blur_px, const CellGate& gate,
                                                    std::span<const Prototype> prototypes, Sightings& seen) {
  const PatternField& field = letters_->at(blur_px);
  mended_.clear(), worn_.clear();
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (const auto node = static_cast<std::int32_t>(i); is_worn(seen, node)) worn_.push_back(node);
  // What is mended holds those beside it.
  while (!worn_.empty()) {
    asked_.clear(), places_.clear(), tasks_.clear();
    for (const std::int32_t node : worn_) look_at(frame, noise, gate, seen, node);
    align(frame, full, field);
    const std::size_t before = mended_.size();
    for (std::size_t i = 0; i < asked_.size(); ++i) {
      const CellClaim& claim = seen.claims[asked_[i]];
      if (!is_there(tasks_[i], seen, asked_[i]) ||
          !shows_centre(frame, field, tasks_[i], array_.at(claim.row, claim.column)))
        continue;
      take_over(tasks_[i], places_[i].frame, prototypes, seen, asked_[i]);
      mended_.push_back(asked_[i]);
    }
    worn_.clear();
    for (std::size_t i = before; i < mended_.size(); ++i) {
      for (const std::int32_t other : seen.nodes[mended_[i]].links)
        if (other >= 0 && seen.claims[other].status != RegionStatus::kDecoded && is_worn(seen, other))
          worn_.push_back(other);
    }
    std::ranges::sort(worn_);
    worn_.erase(std::unique(worn_.begin(), worn_.end()), worn_.end());
  }
  std::ranges::sort(mended_);
  return mended_;
}

}  // namespace slsd
