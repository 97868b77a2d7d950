// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/pixels/pixel_judge.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <utility>

#include "core/clones.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

/// Limits of the evidence around a pixel, natural logarithms: how much likelier the surface has to be than another, or
/// none. Blur makes neighbours alike, some three pixels to an independent one, so this is a chance of one in a
/// thousand.
constexpr float kEvidenceMin = 20, kHalfMin = -3, kEnclosedHalfMin = -5;
/// The same if the surface ends near the pixel: the evidence of one side, and of the pixel's own line, which is the
/// side's border. Another surface that the line may show has to have less evidence by the margin there.
constexpr float kSideMin = 14, kCornerMin = 10, kLineMin = 5, kLineMargin = 1;
/// Evidence all around a pixel counts more than that of a side.
constexpr float kAround = 1000;
/// Planes that differ by more at a pixel are two surfaces, px.
constexpr float kOtherPx = 0.5F;
/// The same between nodes of one surface: nothing may contradict it.
constexpr float kEnclosedMin = -2;
/// Evidence of a single pixel above which it is firm: it is lit, as expected.
constexpr float kFirmMin = 2;
/// Standard deviation to add if a plane is continued beyond its node to an edge, px.
constexpr float kEdgePx = 0.03F;
/// Planes that differ by less at a cell are the same candidate, px.
constexpr float kSamePx = 0.08F;

using BitLanes [[gnu::vector_size(32)]] = std::uint32_t;

/// A plane's patch, in plain numbers: what weigh_lanes() needs.
struct Weighing {
  const float *seen, *x, *y;  // for each pixel, relative to the map's centre, given by first_x and first_y
  int count;                  // a multiple of kLanes
  float first_x, first_y;
  float warp[9];  // row by row
  float origin_u, origin_v;
  const std::uint32_t* samples;
  int field_width, field_height;
  float slope_unit, px_per_px;
  float gain, gain_x, gain_y, offset, full;
  const std::uint32_t* entries;
};

/// Weighs each pixel's evidence for the plane: two numbers for each pixel, see Evidence.
inline __attribute__((always_inline)) void weigh_lanes(const Weighing& in, float* to) {
  constexpr float kScale = PatternField::kSamplesPerPx;
  constexpr int kBits = PatternField::kSlopeBits;
  using Table = EvidenceTable;
  const Lanes zero{}, one = zero + 1;
  const auto clamp = [](const Lanes& from, float last, Lanes& to_lanes) __attribute__((always_inline)) {
    const Lanes none{}, most = none + last;
    to_lanes = from < most ? from : most;
    to_lanes = to_lanes > none ? to_lanes : none;
  };
  for (int first = 0; first < in.count; first += kLanes) {
    Lanes seen, dx, dy;
    load(in.seen + first, seen), load(in.x + first, dx), load(in.y + first, dy);
    dx += in.first_x, dy += in.first_y;
    const Lanes per_q2 = one / (in.warp[6] * dx + in.warp[7] * dy + in.warp[8]);
    Lanes u, v;
    clamp(((in.warp[0] * dx + in.warp[1] * dy + in.warp[2]) * per_q2 + in.origin_u) * kScale,
          static_cast<float>(in.field_width - 1), u);
    clamp(((in.warp[3] * dx + in.warp[4] * dy + in.warp[5]) * per_q2 + in.origin_v) * kScale,
          static_cast<float>(in.field_height - 1), v);
    const IntLanes at_u = __builtin_convertvector(u + 0.5F, IntLanes),
                   at_v = __builtin_convertvector(v + 0.5F, IntLanes);
    const IntLanes at = at_v * in.field_width + at_u;
    BitLanes bits;
    for (int lane = 0; lane < kLanes; ++lane) bits[lane] = in.samples[at[lane]];
    const Lanes slope_u =
        __builtin_convertvector(reinterpret_cast<IntLanes>(bits << (32 - 2 * kBits)) >> (32 - kBits), Lanes) *
        in.slope_unit;
    const Lanes slope_v =
        __builtin_convertvector(reinterpret_cast<IntLanes>(bits << (32 - kBits)) >> (32 - kBits), Lanes) *
        in.slope_unit;
    const Lanes from_u = u - __builtin_convertvector(at_u, Lanes), from_v = v - __builtin_convertvector(at_v, Lanes);
    const Lanes light =
        __builtin_convertvector(reinterpret_cast<IntLanes>(bits >> (2 * kBits)), Lanes) * PatternField::kValueUnit +
        (slope_u * from_u + slope_v * from_v) * (1 / kScale);
    const Lanes steep_u = slope_u > zero ? slope_u : -slope_u, steep_v = slope_v > zero ? slope_v : -slope_v;
    const Lanes gain = in.gain + in.gain_x * dx + in.gain_y * dy;
    const Lanes least = zero + 0.3F * in.gain;
    const Lanes level = (seen - in.offset) / (gain > least ? gain : least);
    Lanes slope, expected, step;
    clamp((steep_u > steep_v ? steep_u : steep_v) * (in.px_per_px / Table::kSlopeStep) + 0.5F, Table::kSlopes - 1,
          slope);
    clamp(light * (Table::kExpected - 1) + 0.5F, Table::kExpected - 1, expected);
    clamp((level - Table::kSeenFirst) * (1 / Table::kSeenStep) + 0.5F, Table::kSeen - 1, step);
    const IntLanes entry =
        (__builtin_convertvector(slope, IntLanes) * Table::kExpected + __builtin_convertvector(expected, IntLanes)) *
            Table::kSeen +
        __builtin_convertvector(step, IntLanes) + ((seen >= in.full) & Table::kOfLight);
    BitLanes found;
    for (int lane = 0; lane < kLanes; ++lane) found[lane] = in.entries[entry[lane]];
    const Lanes counted = seen > zero ? zero + Table::kUnit : zero;  // negative: outside
    const Lanes another = __builtin_convertvector(reinterpret_cast<IntLanes>(found) >> 16, Lanes) * counted;
    const Lanes unlit = __builtin_convertvector(reinterpret_cast<IntLanes>(found << 16) >> 16, Lanes) * counted;
    const Lanes low = __builtin_shufflevector(another, unlit, 0, 8, 1, 9, 2, 10, 3, 11),
                high = __builtin_shufflevector(another, unlit, 4, 12, 5, 13, 6, 14, 7, 15);
    std::memcpy(to + 2 * first, &low, sizeof low);
    std::memcpy(to + 2 * first + kLanes, &high, sizeof high);
  }
}

struct Summing {
  int side, reach, cell;  // sizes of the whole block, of a pixel's surroundings, of the cell
  float of_half;          // added to the evidence of a half
};

/// Sums of evidence around a pixel: over all columns, those to the left and to the right with the own one, and the own
/// one. Pairs of lanes: the whole height, the upper and the lower half with the own row, and the own row.
struct AroundSums {
  Lanes all, left, right, column;
};
enum AroundRows { kWhole = 0, kUpper = 2, kLower = 4, kRow = 6 };

/// @param kOf  0 for the evidence against another surface, 1 for that against none
template <int kOf>
inline __attribute__((always_inline)) void side_lanes(const AroundSums& in, const Evidence& own, Lanes& sides,
                                                      Lanes& lines) {
  constexpr int kWholeOf = kWhole + kOf, kUpperOf = kUpper + kOf, kLowerOf = kLower + kOf, kRowOf = kRow + kOf;
  const Lanes halves = __builtin_shufflevector(in.left, in.right, kWholeOf, 8 + kWholeOf, 0, 0, kUpperOf, 8 + kUpperOf,
                                               kLowerOf, 8 + kLowerOf);
  sides = __builtin_shufflevector(halves, in.all, 0, 1, 8 + kUpperOf, 8 + kLowerOf, 4, 5, 6, 7);
  const Lanes rows = __builtin_shufflevector(in.left, in.right, 0, 0, 0, 0, kRowOf, 8 + kRowOf, kRowOf, 8 + kRowOf);
  const Lanes of_row =
      __builtin_shufflevector(rows, in.all, 8 + kRowOf, 8 + kRowOf, 8 + kRowOf, 8 + kRowOf, 4, 5, 6, 7);
  const Lanes of_column = __builtin_shufflevector(in.column, in.column, kWholeOf, kWholeOf, kWholeOf, kWholeOf,
                                                  kUpperOf, kUpperOf, kLowerOf, kLowerOf);
  // The own pixel is in both the row and the column of a corner.
  const Lanes corners = (of_row + of_column) - (kOf == 0 ? own.against_another : own.against_unlit);
  const Lanes straight = __builtin_shufflevector(of_column, of_row, 0, 1, 10, 11, 4, 5, 6, 7);
  lines = __builtin_shufflevector(straight, corners, 0, 1, 2, 3, 12, 13, 14, 15);
}

inline __attribute__((always_inline)) void split_sides(const AroundSums& in, const Evidence& own, SideEvidence& to) {
  Lanes side, line, side_lit, line_lit;
  side_lanes<0>(in, own, side, line), side_lanes<1>(in, own, side_lit, line_lit);
  std::memcpy(to.line.data(), &line, sizeof line);
  side = side < side_lit ? side : side_lit, line = line < line_lit ? line : line_lit;
  constexpr Lanes kLeast = {kSideMin, kSideMin, kSideMin, kSideMin, kCornerMin, kCornerMin, kCornerMin, kCornerMin};
  const Lanes none = Lanes{} - 1;
  side = ((side >= kLeast) & (line >= Lanes{} + kLineMin)) ? side : none;
  to.most = -1, to.strength = 0;
  for (int k = 0; k < kLanes; ++k)
    if (side[k] > to.strength) to.most = k, to.strength = side[k];
}

/// Sums of evidence over columns: of the rows around a row, without it, and of that row itself.
struct ColumnSums {
  static constexpr int kRows = 4;  // whole height, upper and lower half with the own row, and the own row
  const float* rows[kRows];        // two numbers for each column

  /// Adds a column.
  inline __attribute__((always_inline)) void add(int x, Lanes& total) const {
    Lanes column;
    for (int k = 0; k < kRows; ++k) std::memcpy(reinterpret_cast<char*>(&column) + 8 * k, rows[k] + 2 * x, 8);
    total += column;
  }
};

/// Sums rows of evidence above and below a row. @param sums  three buffers of `pitch` numbers
inline __attribute__((always_inline)) void sum_columns(const float* evidence, std::ptrdiff_t row, int reach, int pitch,
                                                       float* sums) {
  for (int first = 0; first < pitch; first += kLanes) {
    const float* from = evidence + first;
    Lanes above{}, own, below{};
    for (int j = 0; j < reach; ++j, from += row) {
      Lanes more;
      load(from, more);
      above += more;
    }
    load(from, own);
    for (int j = 0; j < reach; ++j) {
      Lanes more;
      load(from += row, more);
      below += more;
    }
    const Lanes upper = above + own, whole = upper + below, lower = own + below;
    std::memcpy(sums + first, &whole, sizeof whole), std::memcpy(sums + pitch + first, &upper, sizeof upper);
    std::memcpy(sums + 2 * static_cast<std::ptrdiff_t>(pitch) + first, &lower, sizeof lower);
  }
}

/// sum_lanes() without the sides, four pixels at once.
/// @param sums  buffer for 6 (side + 4) numbers
inline __attribute__((always_inline)) void sum_enclosed(const Summing& in, const float* evidence, float* sums,
                                                        float* least, float* own) {
  constexpr int kTogether = kLanes / 2;
  const int side = in.side, reach = in.reach, pitch = (2 * side + kLanes - 1) / kLanes * kLanes;
  const auto take_lower = [](const Lanes& a, Lanes& to) __attribute__((always_inline)) {
    to = a < to ? a : to;
  };
  for (int y = 0; y < in.cell; ++y) {
    const float* const rows = evidence + 2 * static_cast<std::ptrdiff_t>(y) * side;
    sum_columns(rows, 2 * static_cast<std::ptrdiff_t>(side), reach, pitch, sums);
    for (int x = 0; x < in.cell; x += kTogether) {
      const float *const whole = sums + 2 * x, *const upper = whole + pitch, *const lower = upper + pitch;
      Lanes left{}, right{}, above{}, below{}, more;
      for (int k = 0; k < reach; ++k) load(whole + 2 * k, more), left += more;
      for (int k = reach + 1; k <= 2 * reach; ++k) load(whole + 2 * k, more), right += more;
      for (int k = 0; k <= 2 * reach; ++k) load(upper + 2 * k, more), above += more;
      for (int k = 0; k <= 2 * reach; ++k) load(lower + 2 * k, more), below += more;
      load(whole + 2 * reach, more);
      Lanes most = left + more + right;
      left += more, right += more;
      take_lower(left, right), take_lower(above, right), take_lower(below, right);
      take_lower(right + in.of_half, most);
      take_lower(__builtin_shufflevector(most, most, 1, 0, 3, 2, 5, 4, 7, 6), most);
      const float* const here = evidence + 2 * ((y + reach) * side + x + reach);
      for (int i = 0; i < kTogether && x + i < in.cell; ++i)
        least[y * in.cell + x + i] = most[2 * i], own[y * in.cell + x + i] = here[2 * i + 1];
    }
  }
}

/// Finds the least evidence around each pixel of a cell: of the whole surroundings, and of the half on each side. The
/// pixel's own line is in both halves. A surface that continues on one side alone ends here, or earlier.
/// @param evidence  two numbers for each of side x side pixels, and some more
/// @param buffer    for 8 (side + 1) numbers, and for 6 (side + 4)
/// @param sides     one for each pixel of the cell; null if not needed
inline __attribute__((always_inline)) void sum_lanes(const Summing& in, const float* evidence, float* buffer,
                                                     float* least, float* own, SideEvidence* sides) {
  const int side = in.side, reach = in.reach, pitch = (2 * side + kLanes - 1) / kLanes * kLanes;
  float* const sums = buffer + 8 * static_cast<std::ptrdiff_t>(side + 1);
  if (sides == nullptr) return sum_enclosed(in, evidence, sums, least, own);
  for (int y = 0; y < in.cell; ++y) {
    const float* const rows = evidence + 2 * static_cast<std::ptrdiff_t>(y) * side;
    sum_columns(rows, 2 * static_cast<std::ptrdiff_t>(side), reach, pitch, sums);
    const ColumnSums columns{{sums, sums + pitch, sums + 2 * static_cast<std::ptrdiff_t>(pitch),
                              rows + 2 * static_cast<std::ptrdiff_t>(reach) * side}};
    Lanes total{};
    std::memcpy(buffer, &total, sizeof total);
    for (int x = 0; x < side; ++x) {
      columns.add(x, total);
      std::memcpy(buffer + 8 * (x + 1), &total, sizeof total);
    }
    for (int x = 0; x < in.cell; ++x) {
      Lanes from, before, behind, to;
      load(buffer + 8 * x, from), load(buffer + 8 * (x + reach), before);
      load(buffer + 8 * (x + reach + 1), behind), load(buffer + 8 * (x + 2 * reach + 1), to);
      const Lanes all = to - from, left = behind - from, right = to - before;
      const float whole = std::min(all[0], all[1]);
      const float halves = std::min(std::min(std::min(all[2], all[3]), std::min(all[4], all[5])),
                                    std::min(std::min(left[0], left[1]), std::min(right[0], right[1])));
      least[y * in.cell + x] = std::min(whole, halves + in.of_half);
      const float* const here = evidence + 2 * ((y + reach) * side + x + reach);
      own[y * in.cell + x] = here[1];
      split_sides({all, left, right, behind - before}, {here[0], here[1]}, sides[y * in.cell + x]);
    }
  }
}

}  // namespace

/// The pixels between four nodes.
struct PixelJudge::Cell {
  const DenseFrame& frame;
  const BlurredPattern& pattern;
  const SurfaceGrid& grid;
  DenseMap& map;
  int column, row;               // place of its top left node
  int left, top, right, bottom;  // its pixels; right and bottom are one past the last
  std::array<const SurfaceNode*, kCandidates> candidates{};
  std::array<Eigen::Vector2i, kCandidates> nodes{};  // column, row
  std::array<Eigen::Vector2f, kCandidates> places{};
  int count = 0;

  [[nodiscard]] float value(int k, float x, float y) const {
    return candidates[k]->plane.at(x - places[k].x(), y - places[k].y());
  }
  void add(int at_column, int at_row) {
    const SurfaceNode* node = grid.good(at_column, at_row);
    if (node == nullptr || count == kCandidates) return;
    candidates[count] = node;
    nodes[count] = {at_column, at_row};
    places[count] = {static_cast<float>(grid.x_of(at_column)), static_cast<float>(grid.y_of(at_row))};
    ++count;
  }
  /// Adds a candidate, unless it equals another or lies too far away.
  void add_other(int at_column, int at_row, int window_px) {
    const int before = count;
    add(at_column, at_row);
    if (count == before) return;
    const float x = 0.5F * static_cast<float>(left + right - 1), y = 0.5F * static_cast<float>(top + bottom - 1);
    const Eigen::Vector2f away = (places[before] - Eigen::Vector2f(x, y)).cwiseAbs();
    if (away.maxCoeff() > static_cast<float>(window_px)) {
      count = before;
      return;
    }
    for (int k = 0; k < before; ++k) {
      const float off = (value(k, x, y) - value(before, x, y)) / candidates[k]->per_px;
      if (std::abs(off) < kSamePx) {
        count = before;
        return;
      }
    }
  }
  /// The mean of the corners, as a node at the first corner.
  [[nodiscard]] SurfaceNode merged() const {
    SurfaceNode node = *candidates[0];
    node.plane = {0, 0, 0};
    node.gain = node.gain_x = node.gain_y = node.offset = node.across = 0;
    for (int k = 0; k < 4; ++k) {
      const SurfaceNode& corner = *candidates[k];
      const Eigen::Vector2f off = places[0] - places[k];
      node.plane.inverse_depth += 0.25F * corner.plane.at(off.x(), off.y());
      node.plane.slope_x += 0.25F * corner.plane.slope_x, node.plane.slope_y += 0.25F * corner.plane.slope_y;
      node.gain += 0.25F * (corner.gain + corner.gain_x * off.x() + corner.gain_y * off.y());
      node.gain_x += 0.25F * corner.gain_x, node.gain_y += 0.25F * corner.gain_y;
      node.offset += 0.25F * corner.offset, node.across += 0.25F * corner.across;
    }
    return node;
  }
  [[nodiscard]] std::size_t pixel(int x, int y) const { return static_cast<std::size_t>(y) * map.width + x; }
};

/// Reads the pixels in and around the cell; -1 for pixels outside the frame.
void PixelJudge::see(const Cell& cell, Scratch& scratch) const {
  std::visit(
      [&](const auto& pixels) {
        const int from_x = cell.left - options_.reach_px, from_y = cell.top - options_.reach_px;
        for (int j = 0; j < side_; ++j) {
          float* to = scratch.seen.data() + static_cast<std::ptrdiff_t>(j) * side_;
          if (from_y + j < 0 || from_y + j >= pixels.height) {
            std::fill(to, to + side_, -1.F);
            continue;
          }
          const auto* row = pixels.row(from_y + j);
          const int first = std::clamp(-from_x, 0, side_), end = std::clamp(pixels.width - from_x, 0, side_);
          std::fill(to, to + first, -1.F), std::fill(to + end, to + side_, -1.F);
          // A hundredth of a level more: zero is a valid level, not the marker -1.
          for (int i = first; i < end; ++i) to[i] = static_cast<float>(row[from_x + i]) + 0.01F;
        }
      },
      cell.frame.pixels);
}

/// Weighs the evidence of each pixel's surroundings for a node's plane.
void PixelJudge::weigh(const Cell& cell, const SurfaceNode& node, int candidate, int as, Scratch& scratch) const {
  const PatchMap map = cell.grid.map_at(cell.nodes[candidate].x(), cell.nodes[candidate].y(),
                                        static_cast<double>(node.plane.inverse_depth));
  const float slope_x = node.plane.slope_x / node.per_px, slope_y = node.plane.slope_y / node.per_px;
  Weighing in;
  for (int k = 0; k < 3; ++k) {
    in.warp[3 * k] = map.base(k, 0) + map.shift[k] * slope_x;
    in.warp[3 * k + 1] = map.base(k, 1) + map.shift[k] * slope_y;
    in.warp[3 * k + 2] = map.base(k, 2);
  }
  in.px_per_px = std::sqrt(std::abs(in.warp[0] * in.warp[4] - in.warp[1] * in.warp[3]));
  in.origin_u = static_cast<float>(map.origin_px.x() + PatternField::kBorderPx) - node.across * map.along.y();
  in.origin_v = static_cast<float>(map.origin_px.y() + PatternField::kBorderPx) + node.across * map.along.x();
  in.seen = scratch.seen.data(), in.x = xs_.data(), in.y = ys_.data();
  in.count = static_cast<int>(xs_.size());
  in.first_x = static_cast<float>(cell.left - options_.reach_px) - map.middle_px.x();
  in.first_y = static_cast<float>(cell.top - options_.reach_px) - map.middle_px.y();
  const PatternField& field = cell.pattern.field(node.blur);
  in.samples = field.samples(), in.field_width = field.width(), in.field_height = field.height();
  in.slope_unit = field.slope_unit();
  in.gain = node.gain, in.gain_x = node.gain_x, in.gain_y = node.gain_y, in.offset = node.offset;
  in.full = static_cast<float>(cell.frame.full);
  in.entries = table_.entries(cell.frame.noise.at(node.offset + 0.5F * node.gain) / node.gain);
  Cloned<weigh_lanes>::call(in, scratch.evidence.data());
  const int stride = cell.grid.stride_px();
  const bool enclosed = as < 0;
  const Summing summing{side_, options_.reach_px, stride,
                        enclosed ? kEnclosedMin - kEnclosedHalfMin : kEvidenceMin - kHalfMin};
  const int at = std::max(as, 0);
  Cloned<sum_lanes>::call(summing, scratch.evidence.data(), scratch.sums.data(), scratch.least[at].data(),
                          scratch.own[at].data(), enclosed ? nullptr : scratch.sides[at].data());
}

namespace {

/// A plane's claim on a pixel.
struct Claim {
  float inverse_depth, per_px;
  float strength;  ///< of its evidence all around, or else on one side; 0 if neither is enough
  int side;        ///< the side with the most evidence; -1 if none has enough
  const SideEvidence* evidence;

  [[nodiscard]] bool is_of_another_surface(const Claim& other) const {
    return std::abs(other.inverse_depth - inverse_depth) > kOtherPx * other.per_px;
  }
  /// Tells whether the pixel's own line shows this plane rather than the other.
  [[nodiscard]] bool wins(const Claim& other) const {
    const auto on_line = [](const Claim& claim, int at) { return claim.evidence->line[at]; };
    return std::ranges::all_of(std::array{side, other.side}, [&](int at) {
      return at < 0 || on_line(*this, at) >= on_line(other, at) + kLineMargin;
    });
  }
};

}  // namespace

/// The plane with the most evidence all around, if there is enough and all planes are one surface there: nothing
/// contests it. -1 if it takes more to tell, which costs several times as much.
int PixelJudge::choose_on_one_surface(const Cell& cell, const Scratch& scratch, int at, int x, int y) const {
  int chosen = -1;
  float most = kEvidenceMin, low = std::numeric_limits<float>::max(), high = std::numeric_limits<float>::lowest(),
        per_px = std::numeric_limits<float>::max();
  for (int k = 0; k < cell.count; ++k) {
    const float value = cell.value(k, static_cast<float>(x), static_cast<float>(y));
    low = std::min(low, value), high = std::max(high, value);
    per_px = std::min(per_px, std::abs(cell.candidates[k]->per_px));
    if (const float around = scratch.least[k][at]; around > most || (chosen < 0 && around == most))
      chosen = k, most = around;
  }
  return high - low <= kOtherPx * per_px ? chosen : -1;
}

/// The plane with the strongest claim that no other surface's claim contests; -1 if there is none.
int PixelJudge::choose_plane(const Cell& cell, const Scratch& scratch, int x, int y) const {
  const int at = (y - cell.top) * cell.grid.stride_px() + x - cell.left;
  if (const int only = choose_on_one_surface(cell, scratch, at, x, y); only >= 0) return only;
  std::array<Claim, kCandidates> all;
  for (int k = 0; k < cell.count; ++k) {
    const SideEvidence& evidence = scratch.sides[k][at];
    const float around = scratch.least[k][at];
    const float strength = around >= kEvidenceMin ? kAround + around : evidence.strength;
    all[k] = {cell.value(k, static_cast<float>(x), static_cast<float>(y)), cell.candidates[k]->per_px, strength,
              evidence.most, &evidence};
  }
  const std::span claims = std::span(all).first(cell.count);
  int chosen = -1;
  for (int k = 0; k < cell.count; ++k) {
    if (!(claims[k].strength > (chosen < 0 ? 0 : claims[chosen].strength))) continue;
    const bool contested = std::ranges::any_of(claims, [&](const Claim& other) {
      return other.strength > 0 && claims[k].is_of_another_surface(other) && !claims[k].wins(other);
    });
    if (!contested) chosen = k;
  }
  return chosen;
}

/// Chooses a plane for each pixel.
void PixelJudge::choose(const Cell& cell, const Scratch& scratch) const {
  const int stride = cell.grid.stride_px();
  const auto depth_min = static_cast<float>(options_.depth_min_mm),
             depth_max = static_cast<float>(options_.depth_max_mm);
  const auto of_full = static_cast<float>(255 / cell.frame.full);
  for (int y = cell.top; y < cell.bottom; ++y) {
    for (int x = cell.left; x < cell.right; ++x) {
      const int at = (y - cell.top) * stride + x - cell.left, best = choose_plane(cell, scratch, x, y);
      const std::size_t pixel = cell.pixel(x, y);
      if (best < 0) {
        cell.map.pixels[pixel] = DensePixel::kNoSupport;
        continue;
      }
      const SurfaceNode& node = *cell.candidates[best];
      const float dx = static_cast<float>(x) - cell.places[best].x(),
                  dy = static_cast<float>(y) - cell.places[best].y();
      const float depth = 1 / node.plane.at(dx, dy);
      if (!(depth >= depth_min && depth <= depth_max)) {
        cell.map.pixels[pixel] = DensePixel::kOutOfDepthRange;
        continue;
      }
      const float sigma = std::sqrt(node.sigma_px * node.sigma_px + kEdgePx * kEdgePx +
                                    node.slope_noise * node.slope_noise * (dx * dx + dy * dy));
      cell.map.depth_mm[pixel] = depth;
      cell.map.sigma_mm[pixel] = node.per_px * depth * depth * sigma;
      cell.map.intensity[pixel] =
          static_cast<std::uint8_t>(std::clamp((node.gain + node.offset) * of_full, 1.F, 255.F));
      cell.map.pixels[pixel] = DensePixel::kMeasured;
      cell.map.firm[pixel] = scratch.own[best][at] > kFirmMin;
    }
  }
}

/// Drops pixels of a blended cell that the frame contradicts.
void PixelJudge::review(Cell& cell, Scratch& scratch) const {
  const int c = cell.column, r = cell.row;
  cell.add(c, r), cell.add(c + 1, r), cell.add(c, r + 1), cell.add(c + 1, r + 1);
  see(cell, scratch);
  weigh(cell, cell.merged(), 0, -1, scratch);
  const int stride = cell.grid.stride_px();
  for (int y = cell.top; y < cell.bottom; ++y) {
    for (int x = cell.left; x < cell.right; ++x) {
      const int at = (y - cell.top) * stride + x - cell.left;
      const std::size_t pixel = cell.pixel(x, y);
      const bool supported = scratch.least[0][at] >= kEnclosedMin;
      if (!supported) cell.map.drop(pixel, DensePixel::kNoSupport);
      cell.map.firm[pixel] = supported && cell.map.measured(pixel) && scratch.own[0][at] > kFirmMin;
    }
  }
}

void PixelJudge::judge_cell(Cell& cell, Scratch& scratch) const {
  const int c = cell.column, r = cell.row;
  for (const auto& [dx, dy] :
       {std::pair(0, 0), {1, 0}, {0, 1}, {1, 1}, {-1, 0}, {2, 0}, {0, -1}, {0, 2}, {-1, 1}, {2, 1}, {1, -1}, {1, 2}}) {
    cell.add_other(c + dx, r + dy, options_.window_px);
  }
  if (cell.count == 0) return;
  see(cell, scratch);
  for (int k = 0; k < cell.count; ++k) weigh(cell, *cell.candidates[k], k, k, scratch);
  choose(cell, scratch);
}

/// Counts the good nodes that may be candidates of each cell of a row, from the one to the left of the first node on.
void PixelJudge::count_goods(const SurfaceGrid& grid, int row, std::vector<float>& goods) {
  constexpr int kReach = 1;  // nodes beyond the cell's own, see judge_cell()
  goods.assign(grid.columns() + 1, 0);
  for (int y = row - kReach; y <= row + 1 + kReach; ++y) {
    const float* const good = grid.goods(y);
    for (int column = -1; column < grid.columns(); ++column)
      for (int x = column - kReach; x <= column + 1 + kReach; ++x) goods[column + 1] += good[x];
  }
}

void PixelJudge::resize(const SurfaceGrid& grid, int workers) {
  const int stride_px = grid.stride_px();
  const int side = stride_px + 2 * options_.reach_px;
  const auto area = static_cast<std::size_t>((side * side + kLanes - 1) / kLanes * kLanes);
  if (side != side_) {
    side_ = side;
    xs_.assign(area, 0), ys_.assign(area, 0);
    for (int i = 0; i < side * side; ++i) xs_[i] = static_cast<float>(i % side), ys_[i] = static_cast<float>(i / side);
    scratch_.clear();
  }
  while (scratch_.size() < static_cast<std::size_t>(workers)) {
    Scratch& scratch = scratch_.emplace_back(CellBlender(grid, options_.depth_min_mm, options_.depth_max_mm));
    scratch.seen.assign(area, -1), scratch.evidence.assign(2 * area + kLanes, 0);
    scratch.sums.assign(14 * static_cast<std::size_t>(side + 4), 0);
    for (int k = 0; k < kCandidates; ++k) {
      scratch.least[k].assign(static_cast<std::size_t>(stride_px) * stride_px, 0);
      scratch.own[k] = scratch.least[k];
      scratch.sides[k].resize(scratch.least[k].size());
    }
  }
}

void PixelJudge::judge(const DenseFrame& frame, const BlurredPattern& pattern, const SurfaceGrid& grid, DenseMap& map,
                       const PixelRectangle& within, Executor& executor) {
  const int stride = grid.stride_px();
  resize(grid, executor.workers());
  for (Scratch& scratch : scratch_) scratch.blender.begin(frame.full);
  executor.run(grid.rows() + 1, [&](int part, int worker) {
    const int row = part - 1, top = std::max(0, grid.y_of(row)), bottom = std::min(map.height, grid.y_of(row) + stride);
    if (top >= bottom) return;
    Scratch& scratch = scratch_[worker];
    const std::span<const CellKind> kinds = scratch.blender.blend_row(grid, row, map);
    count_goods(grid, row, scratch.goods);
    for (int column = -1; column < grid.columns(); ++column) {
      const bool inside = column >= 0 && column + 1 < grid.columns();
      const CellKind kind = inside ? kinds[column] : CellKind::kApart;
      if (kind == CellKind::kClean || scratch.goods[column + 1] == 0) continue;
      Cell cell{frame, pattern, grid, map, column, row, 0, 0, 0, 0};
      cell.left = std::max(0, grid.x_of(column)), cell.top = top;
      cell.right = std::min(map.width, grid.x_of(column) + stride), cell.bottom = bottom;
      if (cell.left >= cell.right || !within.meets({cell.left, cell.top, cell.right, cell.bottom})) continue;
      if (kind == CellKind::kDoubtful) {
        review(cell, scratch);
      } else {
        judge_cell(cell, scratch);
      }
    }
  });
}

}  // namespace slsd
