// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/symbol_view.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "core/clones.hpp"
#include "core/code/symbol.hpp"

namespace slsd {
namespace {

constexpr int kCells = 3;
constexpr int kSubpixels = 3;
constexpr float kLight = 160, kDark = 20;
/// Frames sharper than any lens makes them are drawn ones. Their pixels may coincide with the pattern's; one view in
/// kDrawnOneIn does.
constexpr float kDrawnBlurPx = 0.3F;
constexpr int kDrawnOneIn = 4;

/// Gaussian weights from -reach to reach, with the sum 1.
std::vector<float> gaussian(float sigma_px, int reach) {
  std::vector<float> weights;
  float sum = 0;
  for (int i = -reach; i <= reach; ++i)
    sum += weights.emplace_back(std::exp(-0.5F * static_cast<float>(i * i) / (sigma_px * sigma_px)));
  for (float& weight : weights) weight /= sum;
  return weights;
}

float between(float low, float high, float share) {
  return low + (high - low) * share;
}

float share_of(std::uint32_t draw) {
  return static_cast<float>(draw) * 0x1p-32F;
}

constexpr int kDrawsPerPixel = 3;

/// Noise with a variance of 1. The same in all clones: no product needs to be rounded.
[[gnu::always_inline]] inline void sum_up_draws(const std::uint32_t* draws, int pixels, float* noises) {
  const auto part = [](std::uint32_t draw) { return between(-1, 1, share_of(draw)); };
#pragma omp simd
  for (int i = 0; i < pixels; ++i)
    noises[i] =
        part(draws[kDrawsPerPixel * i]) + part(draws[kDrawsPerPixel * i + 1]) + part(draws[kDrawsPerPixel * i + 2]);
}

/// The cells as light_pixels() finds its way in them.
struct Cells {
  float middle_of_square, width, last;
};

/// The pixel of the cells under each subpixel of a row. One more for the border, to which all points outside are
/// clamped. Whole numbers as floats: SSE2 multiplies and compares these alone. The same in all clones: only whole
/// numbers are multiplied.
[[gnu::always_inline]] inline void find_pixels(int across, const float* columns_u, const float* columns_v, float row_u,
                                               float row_v, const Cells& cells, std::int32_t* pixels) {
  const float middle = cells.middle_of_square, width = cells.width, last = cells.last;
#pragma omp simd
  for (int i = 0; i < across; ++i) {
    const float u = columns_u[i] + row_u + middle, v = columns_v[i] + row_v + middle;
    const float right = static_cast<float>(static_cast<int>(u)) + 1, down = static_cast<float>(static_cast<int>(v)) + 1;
    const float column = right < last ? right : last, row = down < last ? down : last;
    pixels[i] = static_cast<int>((v < 0 ? 0.F : row) * width + (u < 0 ? 0.F : column));
  }
}

constexpr int kTogether = 16;  // pixels whose sums fit into registers

/// The sum of the rows times their weights, in their order: row i begins at first + i * stride.
template <int kCount>
void add_up(const float* first, std::ptrdiff_t stride, const std::vector<float>& weights, float* to) {
  float sums[kCount] = {};
  for (const float weight : weights) {
#pragma omp simd
    for (int x = 0; x < kCount; ++x) sums[x] += weight * first[x];
    first += stride;
  }
  std::copy_n(sums, kCount, to);
}

void add_rows(const float* first, std::ptrdiff_t stride, const std::vector<float>& weights, int count, float* to) {
  int x = 0;
  for (; x + kTogether <= count; x += kTogether) add_up<kTogether>(first + x, stride, weights, to + x);
  for (; x < count; ++x) add_up<1>(first + x, stride, weights, to + x);
}

}  // namespace

bool is_drawn(std::optional<float> blur_px) {
  return blur_px && *blur_px < kDrawnBlurPx;
}

SymbolViewer::SymbolViewer(SymbolViewOptions options) : options_(std::move(options)) {
  for (const int number : options_.symbols) drawings_.push_back(draw_symbol(number, options_.symbol_size_px));
}

float SymbolViewer::share() {
  return share_of(random_());
}

float SymbolViewer::uniform(float low, float high) {
  return between(low, high, share());
}

Eigen::Matrix2f FrameError::of_size(float size) const {
  const auto within = [](float reach, float share) { return between(-reach, reach, share); };
  Eigen::Matrix2f error;
  // Tilt stretches and shears along the base line, which is mostly the pattern's u; the other terms are smaller.
  error << 1 + within(size, shares[0]), within(size, shares[1]), within(0.5F * size, shares[2]),
      1 + within(0.5F * size, shares[3]);
  return error;
}

FrameError SymbolViewer::frame_error() {
  return {{share(), share(), share(), share()}};
}

void SymbolViewer::draw_cells(int letter) {
  const int pitch = options_.symbol_size_px + options_.spacing_px;
  cells_ = Grey8(kCells * pitch + 2, kCells * pitch + 2);
  for (int row = 0; row < kCells; ++row) {
    for (int column = 0; column < kCells; ++column) {
      const bool middle = row == 1 && column == 1;
      const Grey8& drawing = drawings_[middle ? static_cast<std::size_t>(letter) : random_() % drawings_.size()];
      for (int y = 0; y < drawing.height(); ++y) {
        std::copy_n(
            drawing.row(y), drawing.width(),
            cells_.row(row * pitch + y + options_.spacing_px / 2 + 1) + column * pitch + options_.spacing_px / 2 + 1);
      }
    }
  }
}

void SymbolViewer::light_pixels(int side_px) {
  const Eigen::Matrix2f inverse = view_.frame.inverse();
  const float middle_of_square =
      static_cast<float>(options_.symbol_size_px + options_.spacing_px + options_.spacing_px / 2) +
      0.5F * static_cast<float>(options_.symbol_size_px);
  const auto subpixel = [](int index) {
    return static_cast<float>(index / kSubpixels) + (static_cast<float>(index % kSubpixels) - 1) / kSubpixels;
  };
  const int across = kSubpixels * side_px;
  const float width = static_cast<float>(cells_.width()), last = width - 1;
  column_u_.resize(across), column_v_.resize(across), pixels_.resize(across);
  for (int i = 0; i < across; ++i) {
    const float x = subpixel(i) - view_.middle_px.x();
    column_u_[i] = inverse(0, 0) * x, column_v_[i] = inverse(1, 0) * x;
  }
  exposed_.resize(static_cast<std::size_t>(side_px) * side_px);
  for (int row = 0; row < across; ++row) {
    if (row % kSubpixels == 0) lit_.assign(side_px, 0);
    const float y = subpixel(row) - view_.middle_px.y();
    const float row_u = inverse(0, 1) * y, row_v = inverse(1, 1) * y;
    const float *const columns_u = column_u_.data(), *const columns_v = column_v_.data();
    std::int32_t* const pixels = pixels_.data();
    Cloned<find_pixels>::call(across, columns_u, columns_v, row_u, row_v, Cells{middle_of_square, width, last}, pixels);
    const std::uint8_t* const cells = cells_.data();
    for (int x = 0; x < side_px; ++x) {
      const std::int32_t* const three = pixels + kSubpixels * x;
      lit_[x] += cells[three[0]] + cells[three[1]] + cells[three[2]];
    }
    if (row % kSubpixels != kSubpixels - 1) continue;
    float* const light = exposed_.data() + static_cast<std::ptrdiff_t>(row / kSubpixels) * side_px;
    for (int x = 0; x < side_px; ++x) light[x] = static_cast<float>(lit_[x]) / (kSubpixels * kSubpixels);
  }
}

// The border pixels continue beyond the image.
void SymbolViewer::blur(float sigma_px) {
  const int side = view_.image.width(), reach = static_cast<int>(std::ceil(3 * sigma_px));
  const std::vector<float> weights = gaussian(sigma_px, reach);
  const auto row = [side](std::vector<float>& light, int y) {
    return light.data() + static_cast<std::ptrdiff_t>(y) * side;
  };
  blurred_.resize(exposed_.size()), light_.resize(exposed_.size());
  wide_row_.resize(side + 2 * reach);
  for (int y = 0; y < side; ++y) {
    for (int x = -reach; x < side + reach; ++x) wide_row_[x + reach] = row(exposed_, y)[std::clamp(x, 0, side - 1)];
    add_rows(wide_row_.data(), 1, weights, side, row(blurred_, y));
  }
  // Likewise one row above the other, so that those at the border need no special case.
  tall_.resize(static_cast<std::size_t>(side + 2 * reach) * side);
  for (int y = -reach; y < side + reach; ++y)
    std::copy_n(row(blurred_, std::clamp(y, 0, side - 1)), side, row(tall_, y + reach));
  for (int y = 0; y < side; ++y) add_rows(row(tall_, y), side, weights, side, row(light_, y));
}

void SymbolViewer::expose(int letter, float tilt) {
  draw_cells(letter);
  const float scale = options_.camera_px_per_projector_px;
  Eigen::Matrix2f stretch;
  stretch << 1 + tilt * uniform(-0.4F, 0.15F), 0, 0, 1 + tilt * uniform(-0.25F, 0.15F);
  const bool drawn = options_.drawn && random_() % kDrawnOneIn == 0;
  const float roll = (drawn ? 0.F : 1.F) * uniform(-0.1F, 0.1F);
  if (drawn) stretch.setIdentity();
  Eigen::Matrix2f turn;
  turn << std::cos(roll), -std::sin(roll), std::sin(roll), std::cos(roll);
  view_.frame = scale * turn * stretch;

  const float size_px = static_cast<float>(options_.symbol_size_px) * scale;
  const int side = static_cast<int>(std::ceil(1.7F * (size_px + static_cast<float>(options_.spacing_px) * scale))) + 6;
  view_.middle_px.setConstant(0.5F * static_cast<float>(side));
  view_.middle_px.x() += uniform(-0.5F, 0.5F);
  view_.middle_px.y() += uniform(-0.5F, 0.5F);
  if (drawn)
    view_.middle_px.setConstant(static_cast<float>(side / 2) +
                                0.5F * static_cast<float>((options_.symbol_size_px + 1) % 2));
  light_pixels(side);
  blur_share_ = share();
  noise_ = options_.noise ? *options_.noise * (kLight - kDark) : uniform(0.F, 6.F);
  draw_noise(side * side);
  view_.image = Grey8(side, side);
  view_.mask = Grey8(side, side);
}

const SymbolView& SymbolViewer::develop(std::optional<float> blur_px) {
  const float size_px = static_cast<float>(options_.symbol_size_px) * options_.camera_px_per_projector_px;
  blur(blur_px ? *blur_px * between(0.65F, 1.35F, blur_share_)
               : between(0.5F, std::max(1.1F, 0.07F * size_px), blur_share_));
  add_noise();
  return view_;
}

void SymbolViewer::draw_noise(int pixels) {
  draws_.resize(static_cast<std::size_t>(kDrawsPerPixel) * pixels), noises_.resize(pixels);
  for (std::uint32_t& draw : draws_) draw = random_();
  Cloned<sum_up_draws>::call(draws_.data(), pixels, noises_.data());
}

void SymbolViewer::add_noise() {
  const int pixels = view_.image.width() * view_.image.height();
  std::uint8_t *const image = view_.image.data(), *const mask = view_.mask.data();
  const float *const light = light_.data(), *const noises = noises_.data(), noise = noise_;
  const float threshold = kDark + options_.threshold_level * (kLight - kDark);
#pragma omp simd
  for (int i = 0; i < pixels; ++i) {
    const float level = kDark + (kLight - kDark) * light[i] + noise * noises[i];
    image[i] = static_cast<std::uint8_t>(std::clamp(level, 0.F, 255.F));
    mask[i] = level > threshold ? 255 : 0;
  }
}

}  // namespace slsd
