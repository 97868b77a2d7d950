// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/pixels/clean_map.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <utility>

#include "core/clones.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

/// Growth that has crossed an edge may continue in scraps over a surface that does not exist. A connected area without
/// a decoded symbol needs this many times more pixels.
constexpr std::size_t kWithoutSymbol = 20;
constexpr auto kMeasuredByte = static_cast<std::uint8_t>(DensePixel::kMeasured);

constexpr IntLanes kBitOfLane = {1, 2, 4, 8, 16, 32, 64, 128};

/// One bit for each of eight pixels that lie on one surface with their neighbours.
inline __attribute__((always_inline)) void find_joined(const float* depth_mm, const float* beside_mm,
                                                       std::uint64_t& joined) {
  const Lanes none{};
  Lanes here, beside;
  load(depth_mm, here), load(beside_mm, beside);
  const Lanes off = beside - here, far = off > none ? off : -off;
  const IntLanes near = far <= kDepthJump * here;
  const auto parts = std::bit_cast<std::array<std::uint64_t, 4>>(near & kBitOfLane);
  const std::uint64_t all = parts[0] | parts[1] | parts[2] | parts[3];
  joined = (all | all >> 32U) & 0xffU;
}

/// The same for a whole row.
inline __attribute__((always_inline)) void join_row(const float* depth_mm, const float* beside_mm, int count,
                                                    std::uint64_t* bits) {
  for (int x = 0; x + kLanes <= count; x += kLanes) {
    std::uint64_t joined;
    find_joined(depth_mm + x, beside_mm + x, joined);
    bits[x / 64] |= joined << (x % 64);
  }
  for (int x = count / kLanes * kLanes; x < count; ++x) {
    const bool near = std::abs(beside_mm[x] - depth_mm[x]) <= kDepthJump * depth_mm[x];
    bits[x / 64] |= static_cast<std::uint64_t>(near) << (x % 64);
  }
}

/// One bit for each byte with the wanted value. Bytes are less than 128.
inline __attribute__((always_inline)) void pack_row(const std::uint8_t* bytes, int count, std::uint8_t wanted,
                                                    std::uint64_t* bits) {
  constexpr std::uint64_t kOnes = 0x0101010101010101U, kHigh = kOnes << 7U, kGather = 0x0102040810204080U;
  for (int first = 0; first < count; first += 64) {
    std::uint64_t word = 0;
    const int end = std::min(64, count - first);
    int x = 0;
    for (; x + 8 <= end; x += 8) {
      std::uint64_t eight;
      std::memcpy(&eight, bytes + first + x, sizeof eight);
      const std::uint64_t other = ((eight ^ kOnes * wanted) + (kHigh - kOnes)) & kHigh;
      word |= ((other ^ kHigh) >> 7U) * kGather >> 56U << x;
    }
    for (; x < end; ++x) word |= static_cast<std::uint64_t>(bytes[first + x] == wanted) << x;
    bits[first / 64] = word;
  }
}

/// Rows of bits, each as wide as the image.
struct BitRows {
  std::size_t words;
  int height;

  /// Calls with each row's number and the place of its bits.
  template <class Take>
  void for_each_row(Executor& executor, const Take& take) const {
    constexpr std::size_t kRowsAtOnce = 64;
    executor.run_ranges(
        static_cast<std::size_t>(height),
        [&](std::size_t first, std::size_t last, int) {
          for (std::size_t y = first; y < last; ++y) take(static_cast<int>(y), words * y);
        },
        kRowsAtOnce);
  }
  /// Ors, or ands, each bit with the bits up to `reach` before and after it in its row.
  template <class Combine>
  void along(std::uint64_t* row, int reach, std::uint64_t beyond, Combine combine) const {
    for (int step = 0; step < reach; ++step) one_along(row, beyond, combine);
  }
  template <class Combine>
  void one_along(std::uint64_t* row, std::uint64_t beyond, Combine combine) const {
    std::uint64_t before = beyond;
    for (std::size_t w = 0; w < words; ++w) {
      const std::uint64_t here = row[w], behind = w + 1 < words ? row[w + 1] : beyond;
      row[w] = combine(here, combine(here << 1 | before >> 63, here >> 1 | behind << 63));
      before = here;
    }
  }
  /// The same for a row's columns, from all rows to this one.
  template <class Combine>
  void across(const std::uint64_t* from, int y, std::uint64_t* row, int reach, Combine combine) const {
    std::copy_n(from + words * static_cast<std::size_t>(y), words, row);
    for (int k = std::max(0, y - reach); k <= std::min(height - 1, y + reach); ++k) {
      const std::uint64_t* other = from + words * static_cast<std::size_t>(k);
      for (std::size_t w = 0; w < words; ++w) row[w] = combine(row[w], other[w]);
    }
  }
};

/// The next bit with the wanted value; the end if there is none.
int next_bit(const std::uint64_t* row, int from, int end, bool wanted) {
  if (from >= end) return end;
  const std::uint64_t turn = wanted ? 0 : ~std::uint64_t{0};
  int word = from / 64;
  std::uint64_t left = (row[word] ^ turn) & ~std::uint64_t{0} << (from % 64);
  while (left == 0 && (word + 1) * 64 < end) left = row[++word] ^ turn;
  return left == 0 ? end : std::min(end, word * 64 + std::countr_zero(left));
}

/// Calls with the position of each set bit in its row.
template <class Take>
void for_each_bit(const std::uint64_t* row, std::size_t words, const Take& take) {
  for (std::size_t w = 0; w < words; ++w)
    for (std::uint64_t left = row[w]; left != 0; left &= left - 1)
      take(w * 64 + static_cast<std::size_t>(std::countr_zero(left)));
}

}  // namespace

void MapCleaner::drop_unlit_boundaries(DenseMap& map, int reach_px, Executor& executor) {
  const BitRows rows{static_cast<std::size_t>(map.width + 63) / 64, map.height};
  const std::size_t all = rows.words * static_cast<std::size_t>(map.height);
  bits_.resize(all), rows_.resize(all), measured_.resize(all);
  const auto either = [](std::uint64_t a, std::uint64_t b) { return a | b; };
  const auto both = [](std::uint64_t a, std::uint64_t b) { return a & b; };
  rows.for_each_row(executor, [&](int y, std::size_t row) {
    std::uint64_t* const bits = bits_.data() + row;
    Cloned<pack_row>::call(map.firm.data() + static_cast<std::size_t>(y) * map.width, map.width, std::uint8_t{1}, bits);
    rows.along(bits, reach_px, 0, either);
  });
  rows.for_each_row(executor, [&](int y, std::size_t row) {
    rows.across(bits_.data(), y, rows_.data() + row, reach_px, either);
    rows.along(rows_.data() + row, reach_px, ~std::uint64_t{0}, both);
  });
  rows.for_each_row(executor, [&](int y, std::size_t row) {
    const std::size_t first = static_cast<std::size_t>(y) * map.width;
    std::uint64_t *const enclosed = bits_.data() + row, *const measured = measured_.data() + row;
    rows.across(rows_.data(), y, enclosed, reach_px, both);
    Cloned<pack_row>::call(reinterpret_cast<const std::uint8_t*>(map.pixels.data()) + first, map.width, kMeasuredByte,
                           measured);
    for (std::size_t w = 0; w < rows.words; ++w) measured[w] &= ~enclosed[w];
    for_each_bit(measured, rows.words, [&](std::size_t x) { map.drop(first + x, DensePixel::kUnlit); });
  });
}

/// Finds the measured pixels, and those on one surface with the pixel to the right, and below.
void MapCleaner::find_joined(const DenseMap& map, Executor& executor) {
  const BitRows rows{static_cast<std::size_t>(map.width + 63) / 64, map.height};
  const std::size_t all = rows.words * static_cast<std::size_t>(map.height);
  measured_.resize(all), right_.resize(all), below_.resize(all);
  rows.for_each_row(executor, [&](int y, std::size_t row) {
    const std::size_t first = static_cast<std::size_t>(y) * map.width;
    const float* depth = map.depth_mm.data() + first;
    Cloned<pack_row>::call(reinterpret_cast<const std::uint8_t*>(map.pixels.data()) + first, map.width, kMeasuredByte,
                           measured_.data() + row);
    std::fill_n(right_.data() + row, rows.words, 0), std::fill_n(below_.data() + row, rows.words, 0);
    Cloned<join_row>::call(depth, depth + 1, map.width - 1, right_.data() + row);
    if (y + 1 < map.height) Cloned<join_row>::call(depth, depth + map.width, map.width, below_.data() + row);
  });
}

std::int32_t MapCleaner::root(std::int32_t run) {
  while (runs_[run].parent != run) run = runs_[run].parent = runs_[runs_[run].parent].parent;
  return run;
}

/// Finds runs of pixels row by row, and joins them with the runs of the previous row that they touch.
/// @param first  (y, from): start of the next run; the map's width if there is none
/// @param end    (y, first): one past the last pixel of the run
/// @param touch  (y, from, to): whether the run touches one of the previous row in these columns
template <class First, class End, class Touch>
void MapCleaner::find_runs(int width, int height, const First& first, const End& end, const Touch& touch) {
  runs_.clear();
  first_runs_.clear();
  std::size_t before = 0;  // the first run of the previous row
  for (int y = 0; y < height; ++y) {
    const std::size_t begin = runs_.size();
    first_runs_.push_back(begin);
    for (int x = first(y, 0); x < width;) {
      Run run;
      run.y = y, run.first = x, run.end = end(y, x);
      run.parent = static_cast<std::int32_t>(runs_.size()), run.pixels = static_cast<std::uint32_t>(run.end - x);
      runs_.push_back(run);
      x = first(y, run.end);
    }
    std::size_t above = before;
    for (std::size_t run = begin; y > 0 && run < runs_.size(); ++run) {
      while (above < begin && runs_[above].end <= runs_[run].first) ++above;
      for (std::size_t other = above; other < begin && runs_[other].first < runs_[run].end; ++other) {
        if (!touch(y, std::max(runs_[other].first, runs_[run].first), std::min(runs_[other].end, runs_[run].end)))
          continue;
        const std::int32_t a = root(static_cast<std::int32_t>(other)), b = root(static_cast<std::int32_t>(run));
        if (a == b) continue;
        runs_[std::max(a, b)].parent = std::min(a, b);
        runs_[std::min(a, b)].pixels += runs_[std::max(a, b)].pixels;
      }
    }
    before = begin;
  }
  first_runs_.push_back(runs_.size());
}

void MapCleaner::drop_small_components(DenseMap& map, std::size_t least, std::span<const SurfaceSeed> seeds,
                                       Executor& executor) {
  find_joined(map, executor);
  const std::size_t words = static_cast<std::size_t>(map.width + 63) / 64;
  const auto row = [&](const std::vector<std::uint64_t>& bits, int y) {
    return bits.data() + words * static_cast<std::size_t>(y);
  };
  find_runs(
      map.width, map.height, [&](int y, int from) { return next_bit(row(measured_, y), from, map.width, true); },
      [&](int y, int first) { return next_bit(row(right_, y), first, map.width - 1, false) + 1; },
      [&](int y, int from, int to) { return next_bit(row(below_, y - 1), from, to, true) < to; });
  for (const SurfaceSeed& seed : seeds) {
    const auto x = static_cast<int>(std::lround(seed.camera_px.x())),
               y = static_cast<int>(std::lround(seed.camera_px.y()));
    if (x < 0 || y < 0 || x >= map.width || y >= map.height) continue;
    const float depth = map.depth_mm[static_cast<std::size_t>(y) * map.width + x];
    if (!(std::abs(depth * seed.plane.inverse_depth - 1) < kDepthJump)) continue;
    const auto end = runs_.begin() + static_cast<std::ptrdiff_t>(first_runs_[y + 1]);
    const auto run = std::partition_point(runs_.begin() + static_cast<std::ptrdiff_t>(first_runs_[y]), end,
                                          [&](const Run& each) { return each.end <= x; });
    if (run != end) runs_[root(static_cast<std::int32_t>(run - runs_.begin()))].borne = true;
  }
  for (std::size_t run = 0; run < runs_.size(); ++run) {
    const Run& all = runs_[root(static_cast<std::int32_t>(run))];
    if (all.pixels >= (all.borne ? least : kWithoutSymbol * least)) continue;
    for (int x = runs_[run].first; x < runs_[run].end; ++x)
      map.drop(static_cast<std::size_t>(runs_[run].y) * map.width + x, DensePixel::kSmallComponent);
  }
}

std::size_t MapCleaner::bytes() const {
  const auto of = [](const auto& held) { return held.capacity() * sizeof held[0]; };
  return of(runs_) + of(first_runs_) + of(bits_) + of(rows_) + of(measured_) + of(right_) + of(below_) + of(holes_);
}

/// Finds holes of at most so many pixels that lie inside one surface. They are print or dust, as no object so small can
/// be distinguished from these.
void MapCleaner::find_small_holes(const DenseMap& map, std::size_t most) {
  const std::size_t words = static_cast<std::size_t>(map.width + 63) / 64;
  const auto row = [&](int y) { return measured_.data() + words * static_cast<std::size_t>(y); };
  find_runs(
      map.width, map.height, [&](int y, int from) { return next_bit(row(y), from, map.width, false); },
      [&](int y, int first) { return next_bit(row(y), first, map.width, true); }, [](int, int, int) { return true; });
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    const Run& run = runs_[i];
    Run& all = runs_[root(static_cast<std::int32_t>(i))];
    if (all.pixels > most) continue;
    const bool at_the_rim = run.first == 0 || run.end == map.width || run.y == 0 || run.y + 1 == map.height;
    if (at_the_rim) {
      all.farthest = std::numeric_limits<float>::infinity();
      continue;
    }
    const float* depth = map.depth_mm.data() + static_cast<std::size_t>(run.y) * map.width;
    const auto see = [&](float around) {
      if (around > 0) all.nearest = std::min(all.nearest, around), all.farthest = std::max(all.farthest, around);
    };
    see(depth[run.first - 1]), see(depth[run.end]);
    for (int x = run.first; x < run.end; ++x) see(depth[x - map.width]), see(depth[x + map.width]);
  }
  holes_.assign(measured_.size(), 0);
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    const Run& all = runs_[root(static_cast<std::int32_t>(i))];
    if (all.pixels > most || !(all.farthest - all.nearest <= kDepthJump * all.nearest)) continue;
    std::uint64_t* const bits = holes_.data() + words * static_cast<std::size_t>(runs_[i].y);
    for (int x = runs_[i].first; x < runs_[i].end; ++x) bits[x / 64] |= std::uint64_t{1} << (x % 64);
  }
}

void MapCleaner::prune(DenseMap& map, double reach_px, std::size_t hole_most, Executor& executor) {
  if (!(reach_px > 0)) return;
  find_joined(map, executor);
  find_small_holes(map, hole_most);
  const BitRows rows{static_cast<std::size_t>(map.width + 63) / 64, map.height};
  const std::size_t words = rows.words;
  const auto either = [](std::uint64_t a, std::uint64_t b) { return a | b; };
  // Both pixels of every pair that is not joined.
  bits_.assign(measured_.size(), 0), rows_.assign(measured_.size(), 0);
  const std::uint64_t beyond = map.width % 64 == 0 ? 0 : ~std::uint64_t{0} << (map.width % 64);
  for (int y = 0; y < map.height; ++y) {
    const std::size_t row = words * static_cast<std::size_t>(y);
    for (std::size_t w = 0; w < words; ++w) {
      const std::uint64_t here = measured_[row + w];
      const std::uint64_t next = here >> 1 | (w + 1 < words ? measured_[row + w + 1] << 63 : 0);
      const std::uint64_t hole = holes_[row + w];
      const std::uint64_t next_hole = hole >> 1 | (w + 1 < words ? holes_[row + w + 1] << 63 : 0);
      std::uint64_t parted = (here | next) & ~(right_[row + w] | hole | next_hole);
      if (w + 1 == words) parted &= ~(beyond | std::uint64_t{1} << ((map.width - 1) % 64));
      bits_[row + w] |= parted | parted << 1;
      if (w + 1 < words) bits_[row + w + 1] |= parted >> 63;
      if (y + 1 == map.height) continue;
      const std::uint64_t down =
          (here | measured_[row + words + w]) & ~(below_[row + w] | hole | holes_[row + words + w]);
      bits_[row + w] |= down, bits_[row + words + w] |= down;
    }
  }
  // A disc around each: in every row, the bits within its width.
  const int reach = static_cast<int>(std::ceil(reach_px)) - 1;
  for (int y = 0; y < map.height; ++y) {
    std::uint64_t* const edge = bits_.data() + words * static_cast<std::size_t>(y);
    if (std::all_of(edge, edge + words, [](std::uint64_t word) { return word == 0; })) continue;
    int width = 0;
    for (int away = reach; away >= 0; --away) {
      for (; (width + 1) * (width + 1) + away * away < reach_px * reach_px; ++width) rows.one_along(edge, 0, either);
      for (const int other : {y - away, y + away}) {
        if (other < 0 || other >= map.height) continue;
        std::uint64_t* const to = rows_.data() + words * static_cast<std::size_t>(other);
        for (std::size_t w = 0; w < words; ++w) to[w] |= edge[w];
      }
    }
  }
  for (int y = 0; y < map.height; ++y) {
    const std::size_t row = words * static_cast<std::size_t>(y), first = static_cast<std::size_t>(y) * map.width;
    for (std::size_t w = 0; w < words; ++w) rows_[row + w] &= measured_[row + w];
    for_each_bit(rows_.data() + row, words, [&](std::size_t x) { map.drop(first + x, DensePixel::kAtAnEdge); });
  }
}

}  // namespace slsd
