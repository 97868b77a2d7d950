// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/pixels/blend_cells.hpp"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <utility>

#include "core/clones.hpp"

namespace slsd {
namespace {

/// Largest difference between the planes of adjacent nodes for blending, px, and in standard deviations.
constexpr float kAgreePx = 0.12F, kAgreeSigmas = 4;
/// Share of a node's window that agrees, above which the rest counts as noise. Under normal noise it is 0.89 on average
/// for the weights of AlignOptions::outlier_sigmas = 4, and within 0.04 of that; relief, room light and a webcam's
/// sharpening leave 0.8. If another surface covers a fifth of a window, less agrees.
constexpr float kCleanSupport = 0.79F;

using ByteLanes [[gnu::vector_size(8)]] = std::uint8_t;

/// Sets a rectangle of pixels to nothing measured.
void clear(DenseMap& map, int left, int right, int top, int bottom) {
  for (int y = top; y < bottom; ++y) map.clear(static_cast<std::size_t>(y) * map.width + left, right - left);
}

struct Judging {
  const float *good[2], *value[2], *slope_x[2], *slope_y[2], *noise[2], *support[2];  // above, below
  const float* per_px;
  float near, far;  // from the nodes to the cell's middle, px
};
/// Judges eight cells. @param kinds  values of CellKind
inline __attribute__((always_inline)) void judge_lanes(const Judging& in, int column, std::int32_t* kinds) {
  const Lanes zero{};
  Lanes least = zero + 1, most = zero, noise = zero, good = zero + 1, support = zero + 1;
  for (int corner = 0; corner < 4; ++corner) {
    const int down = corner / 2, right = corner % 2, at = column + right;
    Lanes known, value, slope_x, slope_y, own_noise, own_support;
    load(in.good[down] + at, known), load(in.value[down] + at, value);
    load(in.slope_x[down] + at, slope_x), load(in.slope_y[down] + at, slope_y);
    load(in.noise[down] + at, own_noise), load(in.support[down] + at, own_support);
    const Lanes here = value + (right != 0 ? in.far : in.near) * slope_x + (down != 0 ? in.far : in.near) * slope_y;
    least = here < least ? here : least, most = here > most ? here : most;
    noise = own_noise > noise ? own_noise : noise;
    support = own_support < support ? own_support : support;
    good *= known;
  }
  Lanes per_px;
  load(in.per_px + column, per_px);
  const IntLanes one_surface = (good > zero) & (most - least < per_px * (kAgreePx + kAgreeSigmas * noise));
  constexpr auto kDoubt = static_cast<int>(CellKind::kDoubtful), kClean = static_cast<int>(CellKind::kClean);
  const IntLanes is = one_surface ? (support >= kCleanSupport ? IntLanes{} + kClean : IntLanes{} + kDoubt) : IntLanes{};
  std::memcpy(kinds, &is, sizeof is);
}

struct Mixing {
  const float *value[2], *slope_x[2], *slope_y[2], *sigma[2], *light[2];  // above, below
  float y, share, stride;                                                 // of the row of pixels, from the upper nodes
  std::size_t pitch;
};
/// Mixes the planes of eight columns' nodes, at a row of pixels, to the right: a blend with those of the next column.
/// The mean of a node's slope and the mixed slope continues the node's value exactly over any surface of the second
/// order. In the mix of all nodes, half of each slope remains. Whole slopes would lie on a round body's outside.
inline __attribute__((always_inline)) void mix_lanes(const Mixing& in, int column, float* to) {
  const auto mixed = [&](const float* const* from, int at, Lanes& mix) __attribute__((always_inline)) {
    Lanes above, below;
    load(from[0] + at, above), load(from[1] + at, below);
    mix = above + in.share * (below - above);
  };
  Lanes at[2], slope[2], sigma[2], light[2];
  for (int right = 0; right < 2; ++right) {
    const int here = column + right;
    Lanes above, below, above_y, below_y;
    load(in.value[0] + here, above), load(in.value[1] + here, below);
    load(in.slope_y[0] + here, above_y), load(in.slope_y[1] + here, below_y);
    above += 0.5F * in.y * above_y, below += 0.5F * (in.y - in.stride) * below_y;
    at[right] = above + in.share * (below - above);
    mixed(in.slope_x, here, slope[right]), mixed(in.sigma, here, sigma[right]), mixed(in.light, here, light[right]);
  }
  const float per_stride = 1 / in.stride;
  const Lanes numbers[] = {at[0],
                           0.5F * (slope[0] - slope[1]) + per_stride * (at[1] - at[0]),
                           0.5F * per_stride * (slope[1] - slope[0]),
                           sigma[0],
                           per_stride * (sigma[1] - sigma[0]),
                           light[0],
                           per_stride * (light[1] - light[0])};
  for (const Lanes& lanes : numbers) {
    std::memcpy(to + column, &lanes, sizeof lanes);
    to += in.pitch;
  }
}

}  // namespace

namespace {

/// A row of pixels of adjacent cells.
struct Blending {
  const float *coefficients, *per_px;  // of the first cell
  std::size_t pitch;
  int stride, count;  // of pixels
  const std::int32_t* place_cells;
  const float* place_xs;
  std::size_t places;
  float of_full, depth_min_mm, depth_max_mm;
  float *depth_mm, *sigma_mm;
  std::uint8_t* intensity;
};

/// Blends eight pixels. @param outside  adds those out of the range of depths
inline __attribute__((always_inline)) void blend_eight(const Blending& in, int first, std::size_t place,
                                                       float* depth_mm, float* sigma_mm, std::uint8_t* to_intensity,
                                                       IntLanes& outside) {
  IntLanes cell;
  Lanes x;
  std::memcpy(&cell, in.place_cells + place * kLanes, sizeof cell), load(in.place_xs + place * kLanes, x);
  const int from = first / in.stride;
  const auto number = [&](const float* numbers, Lanes& lanes) __attribute__((always_inline)) {
    Lanes cells;
    load(numbers + from, cells);
    permute(cells, cell, lanes);
  };
  Lanes c[7], per_px;
  for (int k = 0; k < 7; ++k) number(in.coefficients + k * in.pitch, c[k]);
  number(in.per_px, per_px);
  const Lanes zero{}, mm = 1 / (c[0] + x * (c[1] + x * c[2]));
  const Lanes of_sigma = per_px * mm * mm * (c[3] + x * c[4]);
  const Lanes least = zero + 1, most = zero + 255;
  Lanes light = (c[5] + x * c[6]) * in.of_full;
  light = light > least ? light : least;
  light = light < most ? light : most;
  const auto intensity = __builtin_convertvector(__builtin_convertvector(light, IntLanes), ByteLanes);
  outside |= ~((mm >= zero + in.depth_min_mm) & (mm <= zero + in.depth_max_mm));
  std::memcpy(depth_mm, &mm, sizeof mm), std::memcpy(sigma_mm, &of_sigma, sizeof of_sigma);
  std::memcpy(to_intensity, &intensity, sizeof intensity);
}

inline __attribute__((always_inline)) bool blend_all(const Blending& in) {
  IntLanes outside{};
  std::size_t place = 0;
  const int whole = in.count - in.count % kLanes;
  for (int first = 0; first < whole; first += kLanes) {
    blend_eight(in, first, place, in.depth_mm + first, in.sigma_mm + first, in.intensity + first, outside);
    place = place + 1 == in.places ? 0 : place + 1;
  }
  if (whole < in.count) {
    float depth_mm[kLanes], sigma_mm[kLanes];
    std::uint8_t intensity[kLanes];
    blend_eight(in, whole, place, depth_mm, sigma_mm, intensity, outside);
    const auto rest = static_cast<std::size_t>(in.count - whole);
    std::memcpy(in.depth_mm + whole, depth_mm, rest * sizeof(float));
    std::memcpy(in.sigma_mm + whole, sigma_mm, rest * sizeof(float));
    std::memcpy(in.intensity + whole, intensity, rest);
  }
  int any = 0;
  for (int lane = 0; lane < kLanes; ++lane) any |= outside[lane];
  return any != 0;
}

}  // namespace

CellBlender::CellBlender(const SurfaceGrid& grid, double depth_min_mm, double depth_max_mm)
    : stride_(grid.stride_px()),
      columns_(grid.columns()),
      depth_min_mm_(static_cast<float>(depth_min_mm)),
      depth_max_mm_(static_cast<float>(depth_max_mm)),
      // The last eight read beyond the last node.
      pitch_(static_cast<std::size_t>(grid.columns()) + 2 * kLanes),
      upper_(kNumbers * pitch_),
      lower_(kNumbers * pitch_),
      coefficients_(kCoefficients * pitch_),
      kinds_(pitch_) {
  const int pixels = std::lcm(stride_, kLanes);
  place_cells_.reserve(pixels), place_xs_.reserve(pixels);
  for (int pixel = 0; pixel < pixels; ++pixel) {
    const int first_of_eight = pixel - pixel % kLanes;
    place_cells_.push_back(pixel / stride_ - first_of_eight / stride_);
    place_xs_.push_back(static_cast<float>(pixel % stride_));
  }
}

void CellBlender::begin(double full) {
  lower_row_ = -2;
  of_full_ = static_cast<float>(255 / full);
}

void CellBlender::read_nodes(const SurfaceGrid& grid, int row, std::vector<float>& to) const {
  const SurfaceNode* const nodes = grid.nodes().data() + static_cast<std::ptrdiff_t>(row) * columns_;
  for (int column = 0; column < columns_; ++column) {
    const SurfaceNode& node = nodes[column];
    const float numbers[kNumbers] = {node.good ? 1.F : 0.F,
                                     node.plane.inverse_depth,
                                     node.plane.slope_x,
                                     node.plane.slope_y,
                                     node.per_px,
                                     node.noise_px,
                                     node.support,
                                     node.sigma_px,
                                     node.gain + node.offset};
    for (int k = 0; k < kNumbers; ++k) to[k * pitch_ + column] = numbers[k];
  }
}

void CellBlender::take_both(Number which, const float* (&of)[2]) const {
  of[0] = upper_.data() + which * pitch_, of[1] = lower_.data() + which * pitch_;
}

void CellBlender::find_kinds() {
  Judging in{};
  take_both(kGood, in.good), take_both(kValue, in.value), take_both(kSlopeX, in.slope_x),
      take_both(kSlopeY, in.slope_y);
  take_both(kNoise, in.noise), take_both(kSupport, in.support);
  in.per_px = upper_.data() + kPerPx * pitch_;
  const auto stride = static_cast<float>(stride_);
  in.near = 0.5F * (stride - 1), in.far = in.near - stride;
  const int cells = columns_ - 1;
  for (int first = 0; first < cells; first += kLanes) {
    std::int32_t kinds[kLanes];
    Cloned<judge_lanes>::call(in, first, kinds);
    for (int lane = 0; lane < kLanes; ++lane) kinds_[first + lane] = static_cast<CellKind>(kinds[lane]);
  }
}

void CellBlender::set_coefficients(int y) {
  Mixing in{};
  take_both(kValue, in.value), take_both(kSlopeX, in.slope_x), take_both(kSlopeY, in.slope_y),
      take_both(kSigma, in.sigma);
  take_both(kLight, in.light);
  in.stride = static_cast<float>(stride_), in.y = static_cast<float>(y), in.share = in.y / in.stride;
  in.pitch = pitch_;
  for (int column = 0; column + 1 < columns_; column += kLanes)
    Cloned<mix_lanes>::call(in, column, coefficients_.data());
}

/// Blends a row of pixels of adjacent cells. @param pixel  the first
void CellBlender::blend_run(int first, int end, std::size_t pixel, DenseMap& map) const {
  const Blending in{coefficients_.data() + first,
                    upper_.data() + kPerPx * pitch_ + first,
                    pitch_,
                    stride_,
                    (end - first) * stride_,
                    place_cells_.data(),
                    place_xs_.data(),
                    place_cells_.size() / kLanes,
                    of_full_,
                    depth_min_mm_,
                    depth_max_mm_,
                    map.depth_mm.data() + pixel,
                    map.sigma_mm.data() + pixel,
                    map.intensity.data() + pixel};
  const bool outside = Cloned<blend_all>::call(in);
  const auto count = static_cast<std::size_t>(in.count);
  std::memset(map.pixels.data() + pixel, static_cast<int>(DensePixel::kMeasured), count);
  std::memset(map.firm.data() + pixel, 1, count);
  for (std::size_t at = pixel; outside && at < pixel + count; ++at) {
    if (map.depth_mm[at] >= depth_min_mm_ && map.depth_mm[at] <= depth_max_mm_) continue;
    map.drop(at, DensePixel::kOutOfDepthRange);
    map.firm[at] = 0;
  }
}

std::span<const CellKind> CellBlender::blend_row(const SurfaceGrid& grid, int row, DenseMap& map) {
  const int cells = std::max(0, columns_ - 1);
  const int top = std::max(0, grid.y_of(row)), bottom = std::min(map.height, grid.y_of(row) + stride_);
  kinds_.assign(kinds_.size(), CellKind::kApart);
  const std::span<const CellKind> kinds = std::span(kinds_).first(cells);
  if (row < 0 || row + 1 >= grid.rows() || cells == 0) {
    slsd::clear(map, 0, map.width, top, bottom);
    return kinds;
  }
  if (lower_row_ == row) {
    upper_.swap(lower_);
  } else {
    read_nodes(grid, row, upper_);
  }
  read_nodes(grid, row + 1, lower_);
  lower_row_ = row + 1;
  find_kinds();
  const auto each_run = [&](bool blended, const auto& take) {
    for (int first = 0, end = 0; first < cells; first = end) {
      const bool is = kinds_[first] != CellKind::kApart;
      end = first + 1;
      while (end < cells && (kinds_[end] != CellKind::kApart) == is) ++end;
      if (is == blended) take(first, end);
    }
  };
  slsd::clear(map, 0, grid.x_of(0), top, bottom);
  slsd::clear(map, grid.x_of(cells), map.width, top, bottom);
  each_run(false, [&](int first, int end) { slsd::clear(map, grid.x_of(first), grid.x_of(end), top, bottom); });
  for (int y = top; y < bottom; ++y) {
    set_coefficients(y - top);
    each_run(true, [&](int first, int end) {
      blend_run(first, end, static_cast<std::size_t>(y) * map.width + grid.x_of(first), map);
    });
  }
  return kinds;
}

}  // namespace slsd
