// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/nodes/search_surface.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "core/clones.hpp"
#include "core/geometry/robust.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

/// Largest number of compared pixels in a window, spread evenly.
constexpr int kPixelsMost = 64;
/// Reach of the search beyond the known depths, projector px, and the largest number of depths.
constexpr double kBeyondPx = 32;
constexpr int kLevelsMost = 320;
/// Largest and smallest number of nodes of known depth from which the evidence is learnt.
constexpr std::size_t kKnownMost = 256, kKnownLeast = 32;
/// Number of wrong depths, of each of these nodes, that show what chance gives.
constexpr int kWrongLevels = 48;
/// Number of levels around the true depth within which a window is similar for a reason.
constexpr int kNearLevels = 4;
/// Share of the windows that lie only partly on the surface.
constexpr double kPartly = 0.2;
/// All windows at all depths are some e^13 trials, of which one in a thousand frames may be wrong.
constexpr float kTotalEvidenceMin = 20;
/// Lead over any other depth that a seed needs: a thousand to one.
constexpr float kGapMin = 7;
/// Evidence that a step to the next line costs: the depth stays or moves by one level, which is one case of three.
constexpr float kOfStep = 1.1F;
/// A window needs at least so many times the noise as contrast.
constexpr float kNoiseMultipleMin = 4;
constexpr std::size_t kPlacesMost = 8192;  // on lines of one kind: thin parts are few

using BitLanes [[gnu::vector_size(32)]] = std::uint32_t;

/// A window and the pattern at some depths.
struct Comparing {
  const float *levels, *weights, *x, *y;  // the frame's levels without their mean
  int count;                              // a multiple of kLanes
  float warp[9], shift[3];                // row by row; and what a level adds to the last column
  float origin_u, origin_v;
  const std::uint32_t* samples;
  int field_width, field_height;
  float pixels, squares;  // sums over the frame's levels
  int depths;
};

/// Computes the correlation of window and pattern.
inline __attribute__((always_inline)) void compare_lanes(const Comparing& in, float* to) {
  constexpr float kScale = PatternField::kSamplesPerPx;
  constexpr int kBits = PatternField::kSlopeBits;
  const Lanes zero{}, one = zero + 1;
  for (int depth = 0; depth < in.depths; ++depth) {
    const auto by = static_cast<float>(depth);
    const float c0 = in.warp[2] + by * in.shift[0], c1 = in.warp[5] + by * in.shift[1],
                c2 = in.warp[8] + by * in.shift[2];
    Lanes sum = zero, squares = zero, product = zero;
    for (int first = 0; first < in.count; first += kLanes) {
      Lanes level, weight, dx, dy;
      load(in.levels + first, level), load(in.weights + first, weight);
      load(in.x + first, dx), load(in.y + first, dy);
      const Lanes per_q2 = one / (in.warp[6] * dx + in.warp[7] * dy + c2);
      Lanes u = ((in.warp[0] * dx + in.warp[1] * dy + c0) * per_q2 + in.origin_u) * kScale + 0.5F,
            v = ((in.warp[3] * dx + in.warp[4] * dy + c1) * per_q2 + in.origin_v) * kScale + 0.5F;
      const Lanes last_u = zero + static_cast<float>(in.field_width - 1),
                  last_v = zero + static_cast<float>(in.field_height - 1);
      u = u < last_u ? u : last_u, v = v < last_v ? v : last_v;
      u = u > zero ? u : zero, v = v > zero ? v : zero;
      const IntLanes at = __builtin_convertvector(v, IntLanes) * in.field_width + __builtin_convertvector(u, IntLanes);
      BitLanes bits;
      for (int lane = 0; lane < kLanes; ++lane) bits[lane] = in.samples[at[lane]];
      const Lanes light = __builtin_convertvector(reinterpret_cast<IntLanes>(bits >> (2 * kBits)), Lanes) * weight;
      sum += light, squares += light * light, product += light * level;
    }
    constexpr float kUnit = PatternField::kValueUnit;
    const float light = sum_of(sum) * kUnit;
    const float spread = sum_of(squares) * kUnit * kUnit - light * light / in.pixels;
    // A window without contrast has no correlation.
    to[depth] = sum_of(product) * kUnit / std::sqrt((spread + 1e-3F * in.pixels) * in.squares);
  }
}

int bin_of(float alike, int bins) {
  return std::clamp(static_cast<int>(alike * static_cast<float>(bins)), 0, bins - 1);
}

}  // namespace

SurfaceSearch::SurfaceSearch(int letters, int window_px)
    : window_px_(window_px), most_(std::log(static_cast<float>(letters))) {
  const int pixels = window_px * window_px, half = window_px / 2;
  int step = (pixels + kPixelsMost - 1) / kPixelsMost;
  while (std::gcd(step, window_px) != 1) ++step;
  for (int i = 0; i < pixels; i += step) {
    xs_.push_back(static_cast<float>(i % window_px - half)), ys_.push_back(static_cast<float>(i / window_px - half));
    weights_.push_back(1);
  }
  while (xs_.size() % kLanes != 0) xs_.push_back(0), ys_.push_back(0), weights_.push_back(0);
}

std::size_t SurfaceSearch::bytes() const {
  const auto of = [](const auto& held) { return held.capacity() * sizeof held[0]; };
  return of(open_) + of(places_) + of(known_) + of(scores_) + of(before_) + of(after_) + of(ways_) + of(depths_) +
         of(own_) + of(longest_) + of(all_) + of(seeds_);
}

/// Chooses the known depths, and some around them.
bool SurfaceSearch::choose_levels(const SurfaceGrid& grid) {
  depths_.clear();
  for (const SurfaceNode& node : grid.nodes())
    if (node.good) depths_.push_back(node.plane.inverse_depth);
  if (depths_.size() < kKnownLeast) return false;
  const auto at = [&](double share) {
    const auto place = depths_.begin() + std::lround(share * static_cast<double>(depths_.size() - 1));
    std::nth_element(depths_.begin(), place, depths_.end());
    return static_cast<double>(*place);
  };
  const double far = at(0.01), near = at(0.99), middle = median_in_place(depths_);
  const auto [width, height] = grid.frame_px();
  levels_.step = std::abs(grid.map_around(0.5 * Eigen::Vector2d(width, height), middle).inverse_depth_per_px);
  const auto [least, most] = grid.inverse_depths();
  const double first = std::max(least, far - kBeyondPx * levels_.step),
               last = std::min(most, near + kBeyondPx * levels_.step);
  levels_.count = static_cast<int>((last - first) / levels_.step) + 1;
  levels_.first = first;
  if (levels_.count > kLevelsMost) {
    levels_.first = std::clamp(middle - kLevelsMost / 2 * levels_.step, first, last - kLevelsMost * levels_.step);
    levels_.count = kLevelsMost;
  }
  return levels_.count > 2 * kNearLevels;
}

/// Reads the window, without its mean; false if it has too little contrast.
bool SurfaceSearch::read_window(const DenseFrame& frame, const SurfaceGrid& grid, const Eigen::Vector2i& place,
                                Scratch& scratch) const {
  const auto [width, height] = grid.frame_px();
  const int half = window_px_ / 2;
  if (place.x() < half || place.y() < half || place.x() + half >= width || place.y() + half >= height) return false;
  scratch.levels.resize(xs_.size());
  std::visit(
      [&](const auto& image) {
        const auto* const middle = image.row(place.y()) + place.x();
        const auto stride = static_cast<std::ptrdiff_t>(image.stride);
        for (std::size_t i = 0; i < xs_.size(); ++i)
          scratch.levels[i] = static_cast<float>(middle[static_cast<int>(ys_[i]) * stride + static_cast<int>(xs_[i])]);
      },
      frame.pixels);
  Lanes sum{}, count{}, squares{}, level, weight;
  for (std::size_t i = 0; i < xs_.size(); i += kLanes) {
    load(scratch.levels.data() + i, level), load(weights_.data() + i, weight);
    sum += weight * level, count += weight;
  }
  const float pixels = sum_of(count);
  const float mean = sum_of(sum) / pixels;
  for (std::size_t i = 0; i < xs_.size(); i += kLanes) {
    load(scratch.levels.data() + i, level), load(weights_.data() + i, weight);
    level = weight * (level - mean), squares += level * level;
    std::memcpy(scratch.levels.data() + i, &level, sizeof level);
  }
  scratch.pixels = pixels, scratch.squares = sum_of(squares);
  const float noise = kNoiseMultipleMin * frame.noise.at(mean);
  return scratch.squares >= noise * noise * pixels;
}

/// Correlates the window that was read with the pattern, from one depth on.
void SurfaceSearch::compare(const PatternField& field, const SurfaceGrid& grid, const Eigen::Vector2i& place,
                            int first_level, int count, Scratch& scratch) const {
  scratch.alike.resize(static_cast<std::size_t>(count));
  Comparing comparing{scratch.levels.data(),
                      weights_.data(),
                      xs_.data(),
                      ys_.data(),
                      static_cast<int>(xs_.size()),
                      {},
                      {},
                      0,
                      0,
                      field.samples(),
                      field.width(),
                      field.height(),
                      scratch.pixels,
                      scratch.squares,
                      0};
  // The projector's lens is linearised again after so many levels.
  constexpr int kLinear = 32;
  for (int first = 0; first < count; first += kLinear) {
    comparing.depths = std::min(kLinear, count - first);
    const double middle = levels_.at(first_level + first + comparing.depths / 2);
    const PatchMap map = grid.map_around(place.cast<double>(), middle);
    const auto per_level = static_cast<float>(levels_.step / map.inverse_depth_per_px);
    const auto back = static_cast<float>(comparing.depths / 2);
    for (int row = 0; row < 3; ++row) {
      comparing.shift[row] = per_level * map.shift[row];
      for (int column = 0; column < 3; ++column) comparing.warp[3 * row + column] = map.base(row, column);
      comparing.warp[3 * row + 2] -= back * comparing.shift[row];
    }
    comparing.origin_u = static_cast<float>(map.origin_px.x() + PatternField::kBorderPx),
    comparing.origin_v = static_cast<float>(map.origin_px.y() + PatternField::kBorderPx);
    Cloned<compare_lanes>::call(comparing, scratch.alike.data() + first);
  }
}

/// Compares a window of known depth with the pattern at that depth, and at some others.
void SurfaceSearch::compare_known(const DenseFrame& frame, const PatternField& field, const SurfaceGrid& grid,
                                  const Eigen::Vector2i& known, std::size_t nth, Scratch& scratch,
                                  Correlations& seen) const {
  const Eigen::Vector2i place(grid.x_of(known.x()), grid.y_of(known.y()));
  if (!read_window(frame, grid, place, scratch)) return;
  const SurfaceNode& node = *grid.good(known.x(), known.y());
  const auto level =
      static_cast<int>(std::lround((static_cast<double>(node.plane.inverse_depth) - levels_.first) / levels_.step));
  const int least = std::clamp(level - 1, 0, levels_.count - 1), most = std::clamp(level + 1, 0, levels_.count - 1);
  compare(field, grid, place, least, most - least + 1, scratch);
  const float best = level < -1 || level > levels_.count ? -1 : *std::ranges::max_element(scratch.alike);
  ++seen.there[bin_of(best, kBins)];
  const int wrong = std::min(kWrongLevels, levels_.count);
  const int first = static_cast<int>(nth * kWrongLevels % static_cast<std::size_t>(levels_.count - wrong + 1));
  compare(field, grid, place, first, wrong, scratch);
  for (int k = 0; k < wrong; ++k)
    if (std::abs(first + k - level) > kNearLevels) ++seen.elsewhere[bin_of(scratch.alike[k], kBins)];
}

/// Learns the evidence of a correlation from windows of known depth.
bool SurfaceSearch::learn(const DenseFrame& frame, const PatternField& field, const SurfaceGrid& grid,
                          Executor& executor) {
  constexpr std::size_t kAtOnce = 16;
  const std::size_t step = std::max<std::size_t>(1, depths_.size() / kKnownMost);
  known_.clear();
  std::size_t nth = 0;
  for (int row = 0; row < grid.rows(); ++row)
    for (int column = 0; column < grid.columns(); ++column)
      if (grid.good(column, row) != nullptr && nth++ % step == 0) known_.emplace_back(column, row);
  std::vector<Correlations> of_workers(static_cast<std::size_t>(executor.workers()));
  executor.run_ranges(
      known_.size(),
      [&](std::size_t first, std::size_t last, int worker) {
        for (std::size_t i = first; i < last; ++i)
          compare_known(frame, field, grid, known_[i], i * step + 1, scratch_[worker], of_workers[worker]);
      },
      kAtOnce);
  std::array<double, kBins> there{}, elsewhere{};
  double all_there = 0, all_elsewhere = 0;
  for (const Correlations& seen : of_workers) {
    for (int bin = 0; bin < kBins; ++bin) {
      there[bin] += seen.there[bin], all_there += seen.there[bin];
      elsewhere[bin] += seen.elsewhere[bin], all_elsewhere += seen.elsewhere[bin];
    }
  }
  if (all_there < kKnownLeast || all_elsewhere == 0) return false;
  double least = 0;
  for (int bin = 0; bin < kBins; ++bin) {
    const double by_chance = (elsewhere[bin] + 1) / (all_elsewhere + kBins),
                 known = (there[bin] + 0.1) / (all_there + 0.1 * kBins);
    least = std::max(least, (1 - kPartly) * known / by_chance + kPartly);  // a higher correlation is no weaker evidence
    says_[bin] = std::min(most_, static_cast<float>(std::log(least)));
  }
  return true;
}

/// Finds the places that nothing has reached.
void SurfaceSearch::find_open(const SurfaceGrid& grid, const Lines& lines) {
  places_.clear();
  open_.assign(static_cast<std::size_t>(lines.lines) * lines.per_line, -1);
  for (int line = 0; line < lines.lines; ++line) {
    for (int index = 0; index < lines.per_line; ++index) {
      const Eigen::Vector2i place = lines.place(line, index);
      if (!grid.open_at(place.cast<float>())) continue;
      open_[static_cast<std::size_t>(line) * lines.per_line + index] = static_cast<std::int32_t>(places_.size());
      places_.push_back(place);
    }
  }
}

/// Calls take() for each open place with those before it on a path: on the line before, beside it; -1 for none.
template <class Take>
void SurfaceSearch::follow(const Lines& lines, bool forwards, const Take& take) const {
  for (int nth = 0; nth < lines.lines; ++nth) {
    const int line = forwards ? nth : lines.lines - 1 - nth, before = forwards ? line - 1 : line + 1;
    for (int index = 0; index < lines.per_line; ++index) {
      const std::int32_t open = open_[static_cast<std::size_t>(line) * lines.per_line + index];
      if (open < 0) continue;
      std::array<std::int32_t, 3> others{-1, -1, -1};
      for (int beside = -1; beside <= 1 && nth > 0; ++beside)
        if (index + beside >= 0 && index + beside < lines.per_line)
          others[beside + 1] = open_[static_cast<std::size_t>(before) * lines.per_line + index + beside];
      take(open, others);
    }
  }
}

/// Drops the places on no path with enough windows for the evidence: windows without contrast add none.
void SurfaceSearch::drop_short_paths(const DenseFrame& frame, const SurfaceGrid& grid, const Lines& lines,
                                     Executor& executor) {
  std::vector<int>&own = own_, &longest = longest_, &all = all_;
  own.resize(places_.size()), all.assign(places_.size(), 0), longest.resize(places_.size());
  executor.run_ranges(places_.size(), [&](std::size_t first, std::size_t last, int worker) {
    for (std::size_t i = first; i < last; ++i) own[i] = read_window(frame, grid, places_[i], scratch_[worker]) ? 1 : 0;
  });
  for (const bool forwards : {true, false}) {
    follow(lines, forwards, [&](std::int32_t open, const std::array<std::int32_t, 3>& others) {
      int before = 0;
      for (const std::int32_t other : others)
        if (other >= 0) before = std::max(before, longest[other]);
      longest[open] = before + own[open];
      all[open] += longest[open];
    });
  }
  std::int32_t kept = 0;
  for (std::int32_t& open : open_) {
    if (open < 0) continue;
    const auto at = static_cast<std::size_t>(open);
    const auto windows = static_cast<float>(all[at] - own[at]);
    open = -1;
    if (windows * most_ < kTotalEvidenceMin) continue;
    places_[static_cast<std::size_t>(kept)] = places_[at];
    open = kept++;
  }
  places_.resize(static_cast<std::size_t>(kept));
}

/// Computes the evidence of each place at each depth.
void SurfaceSearch::weigh(const DenseFrame& frame, const PatternField& field, const SurfaceGrid& grid,
                          Executor& executor) {
  constexpr std::size_t kInPart = 32;
  const auto count = static_cast<std::size_t>(levels_.count);
  scores_.resize(places_.size() * count);
  executor.run(static_cast<int>((places_.size() + kInPart - 1) / kInPart), [&](int part, int worker) {
    Scratch& scratch = scratch_[worker];
    const std::size_t first = static_cast<std::size_t>(part) * kInPart, end = std::min(places_.size(), first + kInPart);
    for (std::size_t i = first; i < end; ++i) {
      float* const scores = scores_.data() + i * count;
      if (!read_window(frame, grid, places_[i], scratch)) {
        std::fill(scores, scores + count, says_[0]);
        continue;
      }
      compare(field, grid, places_[i], 0, levels_.count, scratch);
      for (std::size_t k = 0; k < count; ++k) scores[k] = says_[bin_of(scratch.alike[k], kBins)];
    }
  });
}

/// The greatest evidence of any path that ends at a place at a depth.
/// @param forwards  from the first line on; otherwise from the last
void SurfaceSearch::add_up(const Lines& lines, bool forwards, std::vector<float>& best) {
  const int count = levels_.count;
  best.resize(scores_.size());
  ways_.resize(static_cast<std::size_t>(count) + 2);
  float* const from = ways_.data() + 1;  // by level, with an empty entry at each end
  follow(lines, forwards, [&](std::int32_t open, const std::array<std::int32_t, 3>& others) {
    std::fill(ways_.begin(), ways_.end(), 0.F);
    for (const std::int32_t other : others) {
      if (other < 0) continue;
      const float* const at = best.data() + static_cast<std::size_t>(other) * count;
      for (int k = 0; k < count; ++k) from[k] = std::max(from[k], at[k]);
    }
    const float* const scores = scores_.data() + static_cast<std::size_t>(open) * count;
    float* const to = best.data() + static_cast<std::size_t>(open) * count;
    for (int k = 0; k < count; ++k) to[k] = scores[k] + std::max(from[k], std::max(from[k - 1], from[k + 1]) - kOfStep);
  });
}

/// Takes seeds at places with enough evidence for one depth, and much more than for any other.
void SurfaceSearch::take_seeds() {
  const int count = levels_.count;
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const std::size_t at = i * static_cast<std::size_t>(count);
    const auto total = [&](int k) { return before_[at + k] + after_[at + k] - scores_[at + k]; };
    int best = 0;
    for (int k = 1; k < count; ++k)
      if (total(k) > total(best)) best = k;
    if (total(best) < kTotalEvidenceMin || scores_[at + best] <= 0) continue;
    float next = 0;
    for (int k = 0; k < count; ++k)
      if (std::abs(k - best) > kNearLevels) next = std::max(next, total(k));
    if (total(best) - next < kGapMin) continue;
    seeds_.push_back({places_[i].cast<float>(), {static_cast<float>(levels_.at(best)), 0, 0}});
  }
}

std::span<const SurfaceSeed> SurfaceSearch::find(const DenseFrame& frame, const PatternField& field,
                                                 const SurfaceGrid& grid, Executor& executor) {
  seeds_.clear();
  if (scratch_.size() < static_cast<std::size_t>(executor.workers())) scratch_.resize(executor.workers());
  const auto [width, height] = grid.frame_px();
  bool learnt = false;
  for (const bool upright : {true, false}) {
    Lines lines{upright, (window_px_ + 1) / 3, window_px_, 0, 0};
    for (;; lines.beside_px *= 2) {
      lines.per_line = (upright ? width : height) / lines.beside_px;
      lines.lines = (upright ? height : width) / lines.next_px;
      find_open(grid, lines);
      if (places_.size() <= kPlacesMost) break;
    }
    drop_short_paths(frame, grid, lines, executor);
    if (places_.empty()) continue;
    if (!learnt && !(choose_levels(grid) && learn(frame, field, grid, executor))) return seeds_;
    learnt = true;
    weigh(frame, field, grid, executor);
    add_up(lines, true, before_);
    add_up(lines, false, after_);
    take_seeds();
  }
  return seeds_;
}

}  // namespace slsd
