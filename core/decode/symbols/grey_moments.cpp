// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/grey_moments.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <type_traits>

#include <Eigen/LU>

#include "core/clones.hpp"
#include "core/decode/regions/slide.hpp"

namespace slsd {
namespace {

/// Smallest share of the light at the dark end of a symbol.
constexpr float kLeastLight = 0.3F;

struct PatchPlace {
  int left, top, stride, height;
};

using Words [[gnu::vector_size(2 * kLanes)]] = std::uint16_t;
using Bytes [[gnu::vector_size(2 * kLanes)]] = std::uint8_t;

// The compiler converts words in one step, bytes one by one.
inline __attribute__((always_inline)) Words load_pixels(const std::uint16_t* pixels) {
  Words words;
  std::memcpy(&words, pixels, sizeof words);
  return words;
}
inline __attribute__((always_inline)) Words load_pixels(const std::uint8_t* pixels) {
  std::uint64_t eight = 0;
  std::memcpy(&eight, pixels, sizeof eight);
  using Halves [[gnu::vector_size(2 * kLanes)]] = std::uint64_t;
  static_assert(std::endian::native == std::endian::little);
  return reinterpret_cast<Words>(__builtin_shufflevector(reinterpret_cast<Bytes>(Halves{eight, 0}), Bytes{}, 0, 16, 1,
                                                         16, 2, 16, 3, 16, 4, 16, 5, 16, 6, 16, 7, 16));
}

/// Writes eight pixels of a patch, and extends its range by the pixels that are not kOutside.
struct PatchWriter {
  float* patch;
  Lanes least = Lanes{} + PatchRange().least, greatest = Lanes{} + PatchRange().greatest;

  __attribute__((always_inline)) void write(const Lanes& value) {
    std::memcpy(patch, &value, sizeof value);
    patch += kLanes;
    least = value < least ? value : least;
    greatest = value > greatest ? value : greatest;
  }
  __attribute__((always_inline)) void tell(PatchRange& range) const {
    range = {};
    for (int lane = 0; lane < kLanes; ++lane) {
      range.least = std::min(range.least, least[lane]);
      range.greatest = std::max(range.greatest, greatest[lane]);
    }
  }
};

template <class T>
inline __attribute__((always_inline)) void widen_pixels(const T* pixels, Lanes& grey) {
  grey = __builtin_convertvector(__builtin_convertvector(load_pixels(pixels), IntLanes), Lanes);
}

/// Copies grey values between before[y] and after[y] of each row, and kOutside elsewhere. The patch lies in the frame,
/// padding included.
template <class T>
inline __attribute__((always_inline)) void copy_rows(const ImageView<T>& frame, const PatchPlace& place,
                                                     const PatchEdges& edges, float* patch, PatchRange& range) {
  PatchWriter writer{patch};
  for (int y = 0; y < place.height; ++y) {
    const T* row = frame.row(place.top + y) + place.left;
    const int before = edges.before[y], after = edges.after[y];
    for (int x = 0; x < place.stride; x += kLanes) {
      const IntLanes at = kIntLane + x;
      Lanes grey;
      widen_pixels(row + x, grey);
      writer.write(((at > before) & (at < after)) ? grey : Lanes{} + kOutside);
    }
  }
  writer.tell(range);
}

/// A cell of the grid in a patch's pixels: its centre from the first pixel, and the map from there to projector px.
struct CellSquare {
  float middle_x, middle_y, half_px;
  Eigen::Matrix2f projector_from_camera;

  [[nodiscard]] bool contains(int x, int y) const {
    const Eigen::Vector2f from_middle(static_cast<float>(x) - middle_x, static_cast<float>(y) - middle_y);
    return (projector_from_camera * from_middle).cwiseAbs().maxCoeff() <= half_px;
  }
};

/// Copies like copy_rows, but the pixels of a cell.
template <class T>
inline __attribute__((always_inline)) void copy_square(const ImageView<T>& frame, const PatchPlace& place,
                                                       const CellSquare& cell, float* patch, PatchRange& range) {
  const Eigen::Matrix2f& way = cell.projector_from_camera;
  const float half = cell.half_px;
  PatchWriter writer{patch};
  for (int y = 0; y < place.height; ++y) {
    const T* row = frame.row(place.top + y) + place.left;
    const float down = static_cast<float>(y) - cell.middle_y;
    const Lanes u_of_row = Lanes{} + way(0, 1) * down, v_of_row = Lanes{} + way(1, 1) * down;
    for (int x = 0; x < place.stride; x += kLanes) {
      const Lanes right = kLane + (static_cast<float>(x) - cell.middle_x);
      const Lanes u = right * way(0, 0) + u_of_row, v = right * way(1, 0) + v_of_row;
      Lanes grey;
      widen_pixels(row + x, grey);
      writer.write(((u >= -half) & (u <= half) & (v >= -half) & (v <= half)) ? grey : Lanes{} + kOutside);
    }
  }
  writer.tell(range);
}

/// Light on a patch as 1 + x right + y down, camera px from its centre.
struct Slope {
  float middle_x, middle_y, x, y;
};

/// Divides values above the background by the light.
inline __attribute__((always_inline)) void level_rows(int stride, int rows, const Slope& light, float background,
                                                      float* patch, PatchRange& range) {
  PatchWriter writer{patch};
  for (int y = 0; y < rows; ++y) {
    const float of_row = 1 + light.y * (static_cast<float>(y) - light.middle_y);
    for (int x = 0; x < stride; x += kLanes) {
      Lanes here = of_row + light.x * (kLane + (static_cast<float>(x) - light.middle_x)), value;
      here = here > kLeastLight ? here : Lanes{} + kLeastLight;
      slsd::load(writer.patch, value);
      value = background + (value - background) / here;
      writer.write(value < 0 ? Lanes{} : value);  // kOutside is NaN, which is not below zero
    }
  }
  writer.tell(range);
}

int padded(int width) {
  return (width + kLanes - 1) / kLanes * kLanes;
}

/// Converts raw moments about the patch's centre to central ones over the weight.
GreyMoments central(const RawMoments& raw, const PatchLevels& levels, double middle_x, double middle_y) {
  const auto& m = raw.m;
  GreyMoments g;
  if (m[0][0] <= 0) return g;
  g.background = levels.background, g.peak = levels.peak;
  const double n = 1 / static_cast<double>(m[0][0]);
  const double x = m[1][0] * n, y = m[0][1] * n;
  const double xx = m[2][0] * n, xy = m[1][1] * n, yy = m[0][2] * n;
  g.weight = m[0][0];
  // The brightest pixels, from which the peak is taken, have weight in every ramp.
  if (raw.steady > 0) {
    const double per_steady = 1 / static_cast<double>(raw.steady);
    g.steady_x = static_cast<float>(middle_x + raw.steady_x * per_steady);
    g.steady_y = static_cast<float>(middle_y + raw.steady_y * per_steady);
  }
  const double per_centre = 1 / static_cast<double>(raw.centre);
  g.x = static_cast<float>(middle_x + raw.centre_x * per_centre);
  g.y = static_cast<float>(middle_y + raw.centre_y * per_centre);
  g.m20 = static_cast<float>(xx - x * x);
  g.m11 = static_cast<float>(xy - x * y);
  g.m02 = static_cast<float>(yy - y * y);
  g.m30 = static_cast<float>(m[3][0] * n - 3 * x * xx + 2 * x * x * x);
  g.m21 = static_cast<float>(m[2][1] * n - 2 * x * xy - y * xx + 2 * x * x * y);
  g.m12 = static_cast<float>(m[1][2] * n - 2 * y * xy - x * yy + 2 * y * y * x);
  g.m03 = static_cast<float>(m[0][3] * n - 3 * y * yy + 2 * y * y * y);
  return g;
}

GreyMoments moments_of(const WeighedRegion& weighed) {
  const Eigen::Vector2f middle = weighed.region->middle_px();
  return central(weighed.moments, weighed.levels, middle.x(), middle.y());
}

}  // namespace

GreyMomentMeter::GreyMomentMeter(int margin_px, float patch_px) : margin_px_(margin_px), patch_px_(patch_px) {
  const std::size_t side = static_cast<std::size_t>(padded(static_cast<int>(patch_px))) + kLanes;
  edges_.reserve(2 * side), rows_.reserve(side), patch_.reserve(side * side);
}

/// Marks, in each row of the patch, the first to the last pixel within the margin of the region.
PatchEdges GreyMomentMeter::follow_edge(const Region& region, std::span<const Run> runs) {
  // The first and last columns of the region's rows, with empty rows above and below, twice the margin each.
  const int reach = 2 * margin_px_, rows = height_ + reach;
  edges_.resize(2 * static_cast<std::size_t>(rows));
  std::int16_t* before = edges_.data();
  std::int16_t* after = before + rows;
  std::fill_n(before, rows, std::numeric_limits<std::int16_t>::max());
  std::fill_n(after, rows, std::numeric_limits<std::int16_t>::min());
  int row = -1;
  for (const Run& run : runs) {
    const int y = run.row - region.top + reach;
    if (run.row != row) before[y] = static_cast<std::int16_t>(run.left - region.left - 1);
    after[y] = static_cast<std::int16_t>(run.right - region.left + reach);
    row = run.row;
  }
  slide_least(before, rows, reach + 1);
  slide_greatest(after, rows, reach + 1);
  return {before, after};
}

template <class T>
void GreyMomentMeter::copy_patch(const ImageView<T>& frame, const Region& region, std::span<const Run> runs) {
  left_ = region.left - margin_px_, top_ = region.top - margin_px_;
  width_ = region.width_px() + 2 * margin_px_;
  height_ = region.height_px() + 2 * margin_px_;
  stride_ = padded(width_);
  const PatchEdges edges = follow_edge(region, runs);
  if (lies_in(frame)) {
    patch_.resize(static_cast<std::size_t>(stride_) * height_);
    return Cloned<copy_rows<T>>::call(frame, {left_, top_, stride_, height_}, edges, patch_.data(), range_);
  }
  patch_.assign(static_cast<std::size_t>(stride_) * height_, kOutside);
  for (int y = 0; y < height_; ++y) {
    if (top_ + y < 0 || top_ + y >= frame.height) continue;
    const T* pixels = frame.row(top_ + y);
    float* row = patch_.data() + y * stride_;
    const int end = std::min<int>(edges.after[y], frame.width - left_);
    for (int x = std::max(edges.before[y] + 1, -left_); x < end; ++x) row[x] = static_cast<float>(pixels[left_ + x]);
  }
  range_ = range_of(patch_.data(), stride_ * height_);
}

template <class T>
void GreyMomentMeter::copy_cell(const ImageView<T>& frame, const Eigen::Vector2f& centre_px,
                                const LatticeFrame& lattice_frame, float half_px) {
  const Eigen::Vector2f reach = half_px * lattice_frame.cwiseAbs().rowwise().sum();
  left_ = static_cast<int>(std::floor(centre_px.x() - reach.x())),
  top_ = static_cast<int>(std::floor(centre_px.y() - reach.y()));
  width_ = static_cast<int>(std::ceil(2 * reach.x())) + 2;
  height_ = static_cast<int>(std::ceil(2 * reach.y())) + 2;
  stride_ = padded(width_);
  const CellSquare cell{centre_px.x() - static_cast<float>(left_), centre_px.y() - static_cast<float>(top_), half_px,
                        lattice_frame.inverse()};
  if (lies_in(frame)) {
    patch_.resize(static_cast<std::size_t>(stride_) * height_);
    return Cloned<copy_square<T>>::call(frame, {left_, top_, stride_, height_}, cell, patch_.data(), range_);
  }
  patch_.assign(static_cast<std::size_t>(stride_) * height_, kOutside);
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      if (frame.contains(left_ + x, top_ + y) && cell.contains(x, y))
        patch_[y * stride_ + x] = static_cast<float>(frame.at(left_ + x, top_ + y));
    }
  }
  range_ = range_of(patch_.data(), stride_ * height_);
}

void GreyMomentMeter::level_light(const Eigen::Vector2f& centre_px, const Eigen::Vector2f& shading) {
  PatchLevels levels;
  find_levels(patch_.data(), stride_ * height_, range_, levels);
  const Slope light{centre_px.x() - static_cast<float>(left_), centre_px.y() - static_cast<float>(top_), shading.x(),
                    shading.y()};
  Cloned<level_rows>::call(stride_, height_, light, levels.background, patch_.data(), range_);
}

GreyMoments GreyMomentMeter::moments_of_patch() {
  PatchLevels levels;
  find_levels(patch_.data(), stride_ * height_, range_, levels);
  if (!(levels.peak > levels.background)) return {};
  const float middle_x = 0.5F * static_cast<float>(width_ - 1), middle_y = 0.5F * static_cast<float>(height_ - 1);
  rows_.clear();
  for (int row = 0; row < height_; ++row) {
    const float y = static_cast<float>(row) - middle_y;
    rows_.push_back({y, y * y, y * y * y});
  }
  RawMoments raw;
  sum_moments(patch_.data(), stride_, rows_, middle_x, levels, raw);
  return central(raw, levels, static_cast<float>(left_) + middle_x, static_cast<float>(top_) + middle_y);
}

template <class T>
GreyMoments GreyMomentMeter::measure(const ImageView<T>& frame, const Region& region, std::span<const Run> runs,
                                     SteadyCentre steady) {
  if constexpr (std::is_same_v<T, std::uint8_t>) {
    if (can_be_weighed(frame, region, margin_px_)) {
      WeighedRegion weighed{&region, runs.data()};
      weigh_regions(frame, margin_px_, steady, std::span(&weighed, 1));
      return moments_of(weighed);
    }
  }
  copy_patch(frame, region, runs);
  return moments_of_patch();
}

template <class T>
void GreyMomentMeter::measure_all(const ImageView<T>& frame, const Regions& regions,
                                  std::span<const std::int32_t> which, std::span<GreyMoments> moments) {
  std::array<WeighedRegion, WeighedRegion::kAtOnce> weighed;
  std::array<std::size_t, WeighedRegion::kAtOnce> place;
  std::size_t count = 0;
  const auto weigh = [&] {
    if constexpr (std::is_same_v<T, std::uint8_t>)
      weigh_regions(frame, margin_px_, SteadyCentre::kLeftOut, std::span(weighed).first(count));
    for (std::size_t k = 0; k < count; ++k) moments[place[k]] = moments_of(weighed[k]);
    count = 0;
  };
  for (std::size_t i = 0; i < which.size(); ++i) {
    const Region& region = regions.regions[which[i]];
    bool waits = false;
    if constexpr (std::is_same_v<T, std::uint8_t>) waits = can_be_weighed(frame, region, margin_px_);
    if (waits) {
      weighed[count] = {&region, regions.runs_of(region).data()};
      place[count++] = i;
    } else {
      moments[i] = measure(frame, region, regions.runs_of(region));
    }
    if (count == weighed.size()) weigh();
  }
  weigh();
}

template <class T>
GreyMoments GreyMomentMeter::measure_levelled(const ImageView<T>& frame, const Region& region,
                                              std::span<const Run> runs, const Eigen::Vector2f& shading) {
  copy_patch(frame, region, runs);
  level_light(region.middle_px(), shading);
  return moments_of_patch();
}

template <class T>
GreyMoments GreyMomentMeter::measure_cell(const ImageView<T>& frame, const Eigen::Vector2f& centre_px,
                                          const LatticeFrame& lattice_frame, float half_px,
                                          const Eigen::Vector2f& shading) {
  copy_cell(frame, centre_px, lattice_frame, half_px);
  level_light(centre_px, shading);
  return moments_of_patch();
}

using View8 = ImageView<std::uint8_t>;
using View16 = ImageView<std::uint16_t>;
template GreyMoments GreyMomentMeter::measure(const View8&, const Region&, std::span<const Run>, SteadyCentre);
template GreyMoments GreyMomentMeter::measure(const View16&, const Region&, std::span<const Run>, SteadyCentre);
template void GreyMomentMeter::measure_all(const View8&, const Regions&, std::span<const std::int32_t>,
                                           std::span<GreyMoments>);
template void GreyMomentMeter::measure_all(const View16&, const Regions&, std::span<const std::int32_t>,
                                           std::span<GreyMoments>);
template GreyMoments GreyMomentMeter::measure_levelled(const View8&, const Region&, std::span<const Run>,
                                                       const Eigen::Vector2f&);
template GreyMoments GreyMomentMeter::measure_levelled(const View16&, const Region&, std::span<const Run>,
                                                       const Eigen::Vector2f&);
template GreyMoments GreyMomentMeter::measure_cell(const View8&, const Eigen::Vector2f&, const LatticeFrame&, float,
                                                   const Eigen::Vector2f&);
template GreyMoments GreyMomentMeter::measure_cell(const View16&, const Eigen::Vector2f&, const LatticeFrame&, float,
                                                   const Eigen::Vector2f&);

}  // namespace slsd
