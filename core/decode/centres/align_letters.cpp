// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/align_letters.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "core/clones.hpp"
#include "core/code/symbol.hpp"
#include "core/decode/centres/align_symbols.hpp"
#include "core/lanes.hpp"

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

/// The letter, its light and the limits of a pixel's light, for the pixels of a square.
struct LightOfLetter {
  const std::uint32_t* samples;  ///< of the letters' field
  int field_width, field_height;
  float slope_unit;
  Eigen::Vector2f origin, right, down;  ///< projector px under the task's centre, and their change for a camera px
  float gain, gain_x, gain_y, offset;
  float limit;     ///< grey levels by which the light of a pixel that agrees may be off
  float lit_from;  ///< grey levels of a pixel that is lit
};

/// A rectangle of the frame, within it. Positions are relative to the task's centre.
template <class T>
struct SquareOfFrame {
  const T* first;
  std::ptrdiff_t stride;
  int left, top, columns, rows;
};

/// Numbers of pixels, see LightShares.
struct LightCounts {
  int agree = 0, brighter = 0, beside = 0, darkened = 0;
};

/// PatternField::at() for eight pixels.
inline __attribute__((always_inline)) void find_letter(const LightOfLetter& of, const Lanes& x, float y,
                                                       Lanes& letter) {
  constexpr float kScale = PatternField::kSamplesPerPx;
  constexpr int kBits = PatternField::kSlopeBits;
  using BitLanes [[gnu::vector_size(32)]] = std::uint32_t;
  const auto place = [](const Lanes& px, int count, Lanes& to) __attribute__((always_inline)) {
    const Lanes zero{}, last = zero + static_cast<float>(count - 1);
    to = (px + PatternField::kBorderPx) * kScale;
    to = to > zero ? to : zero;
    to = to < last ? to : last;
  };
  Lanes i, j;
  place(of.origin.x() + x * of.right.x() + y * of.down.x(), of.field_width, i);
  place(of.origin.y() + x * of.right.y() + y * of.down.y(), of.field_height, j);
  const IntLanes column = __builtin_convertvector(i + 0.5F, IntLanes),
                 row = __builtin_convertvector(j + 0.5F, IntLanes);
  const IntLanes at = row * of.field_width + column;
  BitLanes bits;
  for (int lane = 0; lane < kLanes; ++lane) bits[lane] = of.samples[at[lane]];
  const IntLanes value = reinterpret_cast<IntLanes>(bits >> (2 * kBits)),
                 steps_u = reinterpret_cast<IntLanes>(bits << (32 - 2 * kBits)) >> (32 - kBits),
                 steps_v = reinterpret_cast<IntLanes>(bits << (32 - kBits)) >> (32 - kBits);
  const Lanes from_u = i - __builtin_convertvector(column, Lanes), from_v = j - __builtin_convertvector(row, Lanes);
  const Lanes slope_u = __builtin_convertvector(steps_u, Lanes) * of.slope_unit,
              slope_v = __builtin_convertvector(steps_v, Lanes) * of.slope_unit;
  letter =
      __builtin_convertvector(value, Lanes) * PatternField::kValueUnit + (slope_u * from_u + slope_v * from_v) / kScale;
}

template <class T>
inline __attribute__((always_inline)) void count_lights(const SquareOfFrame<T>& square, const LightOfLetter& of,
                                                        LightCounts& to) {
  constexpr float kInk = 0.2F;   // smallest share of the unprinted light that print leaves
  constexpr float kDark = 0.4F;  // share of the letter's light
  IntLanes agree{}, brighter{}, beside{}, darkened{};
  for (int down = 0; down < square.rows; ++down) {
    const T* const pixels = square.first + down * square.stride;
    const auto y = static_cast<float>(square.top + down);
    for (int right = 0; right < square.columns; right += kLanes) {
      const int count = square.columns - right;
      Lanes level{};
      if (count >= kLanes) {
        load(pixels + right, level);
      } else {
        for (int lane = 0; lane < count; ++lane) level[lane] = static_cast<float>(pixels[right + lane]);
      }
      const IntLanes counts = kIntLane < count;
      const Lanes x = kLane + static_cast<float>(square.left + right);
      Lanes letter;
      find_letter(of, x, y, letter);
      const Lanes expected = (of.gain + of.gain_x * x + of.gain_y * y) * letter, light = level - of.offset;
      const Lanes more = light - expected, ink = kInk * expected;
      agree -= counts & (more <= of.limit) & (-more <= of.limit);
      brighter -= counts & (light - of.gain > of.limit);
      beside -= counts & (more > of.limit) & (letter < kDark) & (light > of.lit_from);
      darkened -= counts & (-more > of.limit) & (light > of.limit) & (light > ink);
    }
  }
  for (int lane = 0; lane < kLanes; ++lane) {
    to.agree += agree[lane], to.brighter += brighter[lane];
    to.beside += beside[lane], to.darkened += darkened[lane];
  }
}

/// @param reach  px from the middle to the square's sides
LightShares shares_of_square(const LetterScene& scene, const AskedLetter& asked, const Eigen::Vector2f& middle_px,
                             int reach) {
  constexpr float kLit = 0.3F;  // share of the light around the letter
  const PatchTask& task = asked.task;
  const PatchState& state = task.state;
  // The letter lies in the plane of the grid around it.
  const Eigen::Vector2f from = projector_offset(task.map, state, {0, 0}),
                        right = projector_offset(task.map, state, {1, 0}) - from,
                        down = projector_offset(task.map, state, {0, 1}) - from;
  const LightOfLetter of{.samples = scene.letters.samples(),
                         .field_width = scene.letters.width(),
                         .field_height = scene.letters.height(),
                         .slope_unit = scene.letters.slope_unit(),
                         .origin = from + task.map.origin_px.cast<float>(),
                         .right = right,
                         .down = down,
                         .gain = state.gain,
                         .gain_x = state.gain_x,
                         .gain_y = state.gain_y,
                         .offset = state.offset,
                         .limit = kAlign.outlier_sigmas * std::hypot(task.noise, kAlign.misfit_share * state.gain),
                         .lit_from = kLit * (asked.place.peak - asked.place.background)};
  const Eigen::Vector2i middle = middle_px.array().round().matrix().cast<int>();
  LightCounts counts;
  std::visit(
      [&]<class T>(const ImageView<T>& view) {
        const int left = std::max(middle.x() - reach, 0), top = std::max(middle.y() - reach, 0);
        const int columns = std::min(middle.x() + reach + 1, view.width) - left,
                  rows = std::min(middle.y() + reach + 1, view.height) - top;
        if (columns <= 0 || rows <= 0) return;
        const SquareOfFrame<T> square{view.row(top) + left, view.stride, left - task.x, top - task.y, columns, rows};
        Cloned<count_lights<T>>::call(square, of, counts);
      },
      scene.frame);
  const auto share = [pixels = (2 * reach + 1) * (2 * reach + 1)](int of_them) {
    return static_cast<float>(of_them) / static_cast<float>(pixels);
  };
  return {share(counts.agree), share(counts.brighter), share(counts.beside), share(counts.darkened)};
}

bool has_other_light(const AskedLetter& asked, const LightShares& cell) {
  constexpr float kOfCell = 0.06F;
  return !asked.task.failed && cell.beside >= kOfCell;
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
void LetterAligner::align_eight_of(const LetterScene& scene, std::span<AskedLetter> some) const {
  std::array<PatchTask*, kEight> eight;
  float side_px = std::numeric_limits<float>::max();
  for (std::size_t i = 0; i < some.size(); ++i) {
    eight[i] = &some[i].task;
    side_px = std::min(side_px, pitch_px_ * some[i].place.frame.colwise().norm().minCoeff());
  }
  const int window_px = 2 * static_cast<int>(0.5F * side_px) + 1;
  for (int step = 0; step < kSteps; ++step)
    align_eight(scene.frame, scene.full, scene.letters, kAlign, window_px, {eight.data(), some.size()});
}

void LetterAligner::find_centre(const LetterScene& scene, AskedLetter& asked) const {
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

void LetterAligner::align(const LetterScene& scene, Executor& executor) {
  executor.run_ranges(
      asked_.size(),
      [&](std::size_t first, std::size_t last, int) {
        const std::span<AskedLetter> some = std::span(asked_).subspan(first, last - first);
        align_eight_of(scene, some);
        for (AskedLetter& asked : some) find_centre(scene, asked);
      },
      kEight);
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
  return has_other_light(asked, shares_of_cell(scene, asked));
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
  const LightShares cell = shares_of_cell(scene, asked);
  const bool at_edge =
      has_other_light(asked, cell) || std::max(task.support, cell.agree_beside_print()) < kWholeBesidePrintMin;
  seen.aligned[node] = at_edge ? Aligned::kAtEdge : Aligned::kWhole;
  seen.nodes[node].split = at_edge;
  seen.shapes[node] = Classification::of_letter(letter_of(seen.claims[node]), array_->letters,
                                                at_edge ? kDistanceAtEdge : kDistanceWhole);
}

}  // namespace slsd
