// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/mend_symbols.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "core/code/symbol.hpp"
#include "core/decode/centres/align_symbols.hpp"
#include "core/decode/grid/neighbourhood.hpp"

namespace slsd {
namespace {

constexpr AlignOptions kAlign;
constexpr int kSteps = 5;
constexpr float kAcrossMaxPx = 0.4F;  // off the epipolar line, projector px
/// From where its neighbours put it, and from where it was decoded, of the pitch.
constexpr float kMovedMax = 0.08F;
/// Against kTiltMaxPx: at a corner of what is decoded the surface may turn away.
constexpr float kTiltAtCornersMaxPx = 1;
/// What one alone holds lies nearer to its line, is tilted less, and is seen better: projector px, and of the patch.
constexpr float kLoneAcrossMaxPx = 0.2F, kLoneTiltMaxPx = 0.25F, kLoneSupportMin = 0.85F;
/// Where so much of its middle is brighter than the letter's light, something lies before it.
constexpr float kHidden = 0.5F;
/// From which misfit on, or how far off its line in projector px, what is decoded is aligned, too: whole symbols are
/// nearer to their letters and to their lines. Its centroid is given up where the patch agrees well and lies near it;
/// farther off, what was seen is another part of the symbol.
constexpr float kDoubtfulMisfit = 2.5F, kDoubtfulAcrossPx = 0.25F, kSupportGood = 0.65F;
/// A shape's misfit squared says that its centre is off by a hundredth of it, camera px: see CentreJudge.
constexpr float kMisfitSquaredPerPx = 100;

/// One standard deviation of an aligned letter's place, projector px.
float sigma_px(const PatchTask& task) {
  return aligned_sigma_px(task.residual * task.residual * task.variance, task.scatter, task.support);
}

bool is_worn(const CellGate& gate, const Sightings& seen, std::int32_t node) {
  const CellClaim& claim = seen.claims[node];
  if (claim.island < 0) return false;
  if (claim.status != RegionStatus::kDecoded)
    return claim.status == RegionStatus::kDamagedShape || claim.status == RegionStatus::kOffEpipolarLine;
  return seen.misfits[node] > kDoubtfulMisfit || gate.off_line_px(node, claim.row, claim.column) > kDoubtfulAcrossPx;
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

}  // namespace

LetterFields::LetterFields(const PatternOptions& pattern)
    : cell_px_(static_cast<float>(2 * pattern.symbol_size_px)), fields_(draw_letters(pattern)) {}

Eigen::Vector2f LetterFields::middle_px(int letter) const {
  const float middle = 0.5F * (cell_px_ - 1);
  return {static_cast<float>(letter) * cell_px_ + middle, middle};
}

SymbolMender::SymbolMender(const Pattern& pattern)
    : array_(pattern.array),
      pitch_px_(static_cast<float>(pattern.pitch_px())),
      size_px_(static_cast<float>(pattern.options.symbol_size_px)),
      letters_(std::make_shared<const LetterFields>(pattern.options)) {}

/// Whether one is enough to hold it: it fits the grid tightly, or it is worn and has one of the others where its cell
/// is beside. What its surroundings have refused may be of another surface, whole, or torn between both: not where it
/// is torn, or what lies beside it along the edge that would be there.
bool SymbolMender::stands_with_one(const Sightings& seen, std::int32_t node, std::span<const std::int32_t> others) {
  const CellClaim& claim = seen.claims[node];
  if (claim.status == RegionStatus::kDecoded) return false;
  const bool tight = claim.grid_fit == GridFit::kTight;
  if (claim.status == RegionStatus::kNeighboursDisagree)
    return tight && !seen.shapes[node].is_torn() && !is_beside_torn(seen, node);
  if (tight) return true;
  return std::ranges::any_of(kDirections, [&](Direction d) {
    const std::int32_t other = neighbour(seen.nodes, node, d);
    return other >= 0 && claim.fits(seen.claims[other], d) && std::ranges::binary_search(others, other);
  });
}

/// Whether one of the two to each side of it is torn, across the way to what holds it.
bool SymbolMender::is_beside_torn(const Sightings& seen, std::int32_t node) {
  constexpr int kFar = 2;
  return std::ranges::any_of(kDirections, [&](Direction held_from) {
    if (decoded_beside(seen.nodes, seen.claims, node, held_from) < 0) return false;
    for (const int side : {0, 1}) {
      const Direction along = across(held_from, side);
      std::int32_t other = seen.nodes[node].links[along];
      for (int i = 0; i < kFar && other >= 0; ++i, other = seen.nodes[other].links[along])
        if (seen.shapes[other].is_torn()) return true;
    }
    return false;
  });
}

/// Between those on both sides of it, or one step on from two in a line; the mean.
SymbolMender::Place SymbolMender::place_by_neighbours(const Sightings& seen, std::int32_t node) const {
  const auto holder = [&](std::int32_t of, Direction d) { return decoded_beside(seen.nodes, seen.claims, of, d); };
  Place place;
  float count = 0;
  for (const Direction d : kDirections) {
    const std::int32_t beside = holder(node, d);
    if (beside < 0) continue;
    ++place.held_by;
    const GreyMoments& light = seen.moments[beside];
    place.frame += seen.nodes[beside].frame, place.background += light.background, place.peak += light.peak;
    const Eigen::Vector2f& centre = seen.nodes[beside].centre_px;
    const std::int32_t behind = holder(node, opposite(d)), next = holder(beside, d);
    if (behind >= 0) {
      place.centre_px += 0.5F * (centre + seen.nodes[behind].centre_px), ++count;
    } else if (next >= 0) {
      place.centre_px += 2 * centre - seen.nodes[next].centre_px, ++count;
    }
  }
  if (count == 0) return {};
  const auto held_by = static_cast<float>(place.held_by);
  return {place.centre_px / count, place.frame / held_by, place.background / held_by, place.peak / held_by,
          place.held_by};
}

/// Sets up the task of a node that enough hold, or one that may be enough.
void SymbolMender::look_at(const Scene& scene, Held held, std::int32_t node) {
  const Sightings& seen = scene.seen;
  const Place place = place_by_neighbours(seen, node);
  const auto is_enough = [&] {
    switch (held) {
      case Held::kByOne:
        return place.held_by == 1 && stands_with_one(seen, node, to_ask_);
      case Held::kByTwo:
        return place.held_by >= kHeldBy;
      case Held::kAtCorner:
        break;
    }
    return place.held_by == kHeldBy;
  };
  if (is_enough()) set_up(scene, place, node);
}

/// Unless its window reaches beyond the frame.
void SymbolMender::set_up(const Scene& scene, const Place& place, std::int32_t node) {
  const Sightings& seen = scene.seen;
  const auto [width, height] =
      std::visit([](const auto& view) { return std::pair(view.width, view.height); }, scene.frame);
  const int x = static_cast<int>(std::lround(place.centre_px.x())),
            y = static_cast<int>(std::lround(place.centre_px.y())),
            reach = static_cast<int>(std::ceil(0.5F * pitch_px_ * place.frame.colwise().norm().maxCoeff()));
  if (x < reach || y < reach || x + reach >= width || y + reach >= height) return;
  const CellClaim& claim = seen.claims[node];
  const Eigen::Vector2f middle = letters_->middle_px(letter_of(claim));
  PatchTask task;
  task.x = x, task.y = y;
  task.noise = scene.noise.at(0.5F * (place.background + place.peak));
  // The light around it to begin with, so that what is printed there counts little from the first step on.
  task.state.gain = place.peak - place.background, task.state.offset = place.background;
  // The letter lies as the neighbours do; what depth moves it by is an offset along the epipolar line, which a tilt
  // makes another from pixel to pixel.
  PatchMap& map = task.map;
  map.middle_px = {static_cast<float>(x), static_cast<float>(y)};
  map.origin_px = middle.cast<int>();
  map.along = scene.gate.way_of_line(node, claim.row, claim.column);
  map.shift = {map.along.x(), map.along.y(), 0};
  map.base.setIdentity();
  map.base.topLeftCorner<2, 2>() = place.frame.inverse();
  map.base.topRightCorner<2, 1>() =
      middle - map.origin_px.cast<float>() + map.base.topLeftCorner<2, 2>() * (map.middle_px - place.centre_px);
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

/// Of those that print leaves as they are, counted as two fifths at least: fewer tell too little.
float SymbolMender::Shares::agree_beside_print() const {
  return agree / std::max(1 - darkened, 0.4F);
}

/// @param reach  px from the middle to the square's sides
SymbolMender::Shares SymbolMender::shares_of_square(const GreyView& frame, const PatternField& field,
                                                    const PatchTask& task, const Eigen::Vector2f& middle_px,
                                                    int reach) {
  constexpr float kInk = 0.2F;  // of the light of what is not printed on, at least
  const PatchState& state = task.state;
  const float limit = kAlign.outlier_sigmas * std::hypot(task.noise, kAlign.misfit_share * state.gain);
  const Eigen::Vector2i middle = middle_px.array().round().matrix().cast<int>();
  // The letter lies in a plane, as the grid around it does.
  const Eigen::Vector2f from = projector_offset(task.map, state, {0, 0}),
                        right = projector_offset(task.map, state, {1, 0}) - from,
                        down = projector_offset(task.map, state, {0, 1}) - from,
                        origin = from + task.map.origin_px.cast<float>();
  const auto light_at = [&](const Eigen::Vector2f& off) {
    const Eigen::Vector2f pixel = origin + off.x() * right + off.y() * down;
    return (state.gain + state.gain_x * off.x() + state.gain_y * off.y()) * field.at(pixel.x(), pixel.y()).value;
  };
  const auto count = [&](const auto& view) {
    int agree = 0, brighter = 0, brighter_there = 0, darkened = 0;
    for (int y = middle.y() - reach; y <= middle.y() + reach; ++y) {
      for (int x = middle.x() - reach; x <= middle.x() + reach; ++x) {
        if (!view.contains(x, y)) continue;
        const float expected = light_at({static_cast<float>(x - task.x), static_cast<float>(y - task.y)});
        const float light = static_cast<float>(view.at(x, y)) - state.offset;
        agree += std::abs(light - expected) <= limit;
        brighter += light - state.gain > limit;
        brighter_there += light - expected > limit;
        darkened += expected - light > limit && light > std::max(limit, kInk * expected);
      }
    }
    const auto share = [pixels = (2 * reach + 1) * (2 * reach + 1)](int of_them) {
      return static_cast<float>(of_them) / static_cast<float>(pixels);
    };
    return Shares{share(agree), share(brighter), share(brighter_there), share(darkened)};
  };
  return std::visit(count, frame);
}

/// Where another surface hides the centre, the camera does not see the point. At a corner of what is decoded a surface
/// is likelier to end: the more of the middle has to be seen the less of the patch is. Elsewhere what print darkens
/// does not count.
bool SymbolMender::shows_centre(const PatchTask& task, const Shares& middle, int held_by) {
  constexpr float kMiddleMin = 0.67F, kBothAtCornersMin = 1.45F;
  if (held_by > kHeldBy) return middle.agree_beside_print() >= kMiddleMin;
  return middle.agree >= kMiddleMin && task.support + middle.agree >= kBothAtCornersMin;
}

SymbolMender::Shares SymbolMender::shares_of_cell(const Scene& scene, const PatchTask& task,
                                                  const LatticeFrame& lattice_frame) const {
  const int reach = static_cast<int>(0.5F * pitch_px_ * lattice_frame.colwise().norm().minCoeff());
  return shares_of_square(scene.frame, scene.field, task, task.map.middle_px, reach);
}

float SymbolMender::support_beside_print(const Scene& scene, const PatchTask& task,
                                         const LatticeFrame& lattice_frame) const {
  return std::max(task.support, shares_of_cell(scene, task, lattice_frame).agree_beside_print());
}

float SymbolMender::tilt_px(const PatchTask& task, const Place& place) const {
  const Eigen::RowVector2f slopes(task.state.slope_x, task.state.slope_y);
  return 0.5F * pitch_px_ * (slopes * place.frame).norm();
}

/// Whether it settled near where it was looked for, and on its line.
bool SymbolMender::lies_there(const PatchTask& task, const Place& place, const Eigen::Vector2f& centre,
                              const Sightings& seen, std::int32_t node) const {
  const RegionStatus status = seen.claims[node].status;
  const bool lone = place.held_by < kHeldBy, refused = status == RegionStatus::kNeighboursDisagree;
  if (task.failed || std::abs(task.moved) > kSettledPx) return false;
  if (std::abs(task.state.across) > (lone ? kLoneAcrossMaxPx : kAcrossMaxPx)) return false;
  if (std::abs(task.state.disparity) > kMovedMax * pitch_px_) return false;
  // What is tilted out of all proportion lies anywhere.
  if (!((centre - task.map.middle_px).norm() < 0.5F * pitch_px_)) return false;
  if (lone || refused) return std::abs(task.state.disparity) <= kTightSlip * pitch_px_;
  if (status != RegionStatus::kDecoded) return true;
  const Eigen::Vector2f moved_px = centre - seen.nodes[node].centre_px;
  return (seen.nodes[node].frame.inverse() * moved_px).norm() < kMovedMax * pitch_px_;
}

void SymbolMender::take_over(const PatchTask& task, const LatticeFrame& lattice_frame,
                             std::span<const Prototype> prototypes, Sightings& seen, std::int32_t node) const {
  CellClaim& claim = seen.claims[node];
  const int letter = letter_of(claim);
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

bool SymbolMender::is_asked(const Scene& scene, std::int32_t node) {
  return is_worn(scene.gate, scene.seen, node) || may_return(scene.seen, node);
}

void SymbolMender::ask_all(const Scene& scene) {
  to_ask_.clear();
  for (std::size_t i = 0; i < scene.seen.size(); ++i)
    if (const auto node = static_cast<std::int32_t>(i); is_asked(scene, node)) to_ask_.push_back(node);
}

/// Those beside what was mended, from one on. What one alone holds is not certain enough to hold what was refused and
/// does not fit the grid tightly: so another surface would come in from symbol to symbol.
void SymbolMender::ask_beside(const Scene& scene, std::size_t first, Held held) {
  const auto may_be_held = [&](const CellClaim& claim) {
    if (claim.status == RegionStatus::kDecoded) return false;
    return held == Held::kByTwo || claim.status != RegionStatus::kNeighboursDisagree ||
           claim.grid_fit == GridFit::kTight;
  };
  to_ask_.clear();
  for (std::size_t i = first; i < mended_.size(); ++i) {
    for (const std::int32_t other : scene.seen.nodes[mended_[i]].links)
      if (other >= 0 && may_be_held(scene.seen.claims[other]) && is_asked(scene, other)) to_ask_.push_back(other);
  }
  sort_asked();
}

/// Each once.
void SymbolMender::sort_asked() {
  std::ranges::sort(to_ask_);
  to_ask_.erase(std::unique(to_ask_.begin(), to_ask_.end()), to_ask_.end());
}

/// @param held  by how many at least; by one, and at a corner, by no more
void SymbolMender::mend_asked(const Scene& scene, Held held) {
  Sightings& seen = scene.seen;
  const bool lone = held == Held::kByOne;
  const float tilt_max_px = lone ? kLoneTiltMaxPx : held == Held::kByTwo ? kTiltMaxPx : kTiltAtCornersMaxPx;
  asked_.clear(), places_.clear(), tasks_.clear();
  for (const std::int32_t node : to_ask_) look_at(scene, held, node);
  align(scene.frame, scene.full, scene.field);
  agreeing_.clear(), lone_.clear();
  for (std::size_t i = 0; i < asked_.size(); ++i) {
    const std::int32_t node = asked_[i];
    const CellClaim& claim = seen.claims[node];
    const Place& place = places_[i];
    PatchTask& task = tasks_[i];
    const Eigen::Vector2f centre = centre_of(task, letter_of(claim));
    if (!lies_there(task, place, centre, seen, node)) continue;
    if (tilt_px(task, place) > tilt_max_px) {
      const bool at_corner = place.held_by == kHeldBy && claim.status != RegionStatus::kNeighboursDisagree;
      if (at_corner && held == Held::kByTwo) turned_.push_back(node);
      continue;
    }
    const Shares middle = shares_of_square(scene.frame, scene.field, task, centre, kMiddleReachPx);
    const bool shown = shows_centre(task, middle, place.held_by);
    if (shown && (lone || (place.held_by > kHeldBy && task.support < kSupportGood)))
      task.support = support_beside_print(scene, task, place.frame);
    const float of_two = claim.status == RegionStatus::kDecoded ? kSupportGood : kWholeSupportMin;
    if (shown && task.support >= (lone ? kLoneSupportMin : of_two)) {
      agreeing_.push_back(i);
      if (lone) lone_.push_back(node);
    } else if (claim.status == RegionStatus::kDamagedShape && middle.brighter > kHidden) {
      seen.misfits[node] = std::numeric_limits<float>::infinity();
    }
  }
  for (const std::size_t i : agreeing_) {
    if (lone && !stands_with_one(seen, asked_[i], lone_)) continue;
    take_over(tasks_[i], places_[i].frame, scene.prototypes, seen, asked_[i]);
    mended_.push_back(asked_[i]);
  }
}

const std::vector<std::int32_t>& SymbolMender::mend(const GreyView& frame, double full, const FrameNoise& noise,
                                                    float blur_px, const CellGate& gate,
                                                    std::span<const Prototype> prototypes, Sightings& seen) {
  const Scene scene{frame, full, noise, letters_->at(blur_px), gate, prototypes, seen};
  mended_.clear(), turned_.clear();
  ask_all(scene);
  std::size_t since = 0;
  bool any = true;
  for (bool first = true; any; first = false) {
    // What is mended holds those beside it.
    while (!to_ask_.empty()) {
      const std::size_t before = mended_.size();
      mend_asked(scene, Held::kByTwo);
      ask_beside(scene, before, Held::kByTwo);
    }
    if (first) {
      ask_all(scene);
    } else {
      ask_beside(scene, since, Held::kByTwo);
    }
    since = mended_.size();
    mend_asked(scene, Held::kByOne);
    const bool any_by_one = mended_.size() > since;
    if (!any_by_one) mend_groups(scene);
    ask_beside(scene, since, any_by_one ? Held::kByOne : Held::kByTwo);
    any = mended_.size() > since;
  }
  // Last, so that nothing is mended by them: they may be of another surface.
  std::ranges::sort(mended_);
  to_ask_.clear();
  for (const std::int32_t node : turned_)
    if (!std::ranges::binary_search(mended_, node)) to_ask_.push_back(node);
  sort_asked();
  mend_asked(scene, Held::kAtCorner);
  std::ranges::sort(mended_);
  return mended_;
}

}  // namespace slsd
