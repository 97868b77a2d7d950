// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbol_view.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "core/code/symbol.hpp"

namespace slsd {
namespace {

constexpr int kCells = 3;
constexpr int kSubpixels = 3;
constexpr float kLight = 160, kDark = 20;

/// From -reach to reach, with the sum 1.
std::vector<float> gaussian(float sigma_px, int reach) {
  std::vector<float> weights;
  float sum = 0;
  for (int i = -reach; i <= reach; ++i)
    sum += weights.emplace_back(std::exp(-0.5F * static_cast<float>(i * i) / (sigma_px * sigma_px)));
  for (float& weight : weights) weight /= sum;
  return weights;
}

void add_scaled(float weight, const float* from, int count, float* to) {
#pragma omp simd
  for (int x = 0; x < count; ++x) to[x] += weight * from[x];
}

}  // namespace

SymbolViewer::SymbolViewer(SymbolViewOptions options) : options_(std::move(options)) {
  for (const int number : options_.symbols) drawings_.push_back(draw_symbol(number, options_.symbol_size_px));
}

float SymbolViewer::uniform(float low, float high) {
  return low + (high - low) * static_cast<float>(random_()) * 0x1p-32F;
}

Eigen::Matrix2f SymbolViewer::frame_error(float size) {
  Eigen::Matrix2f error;
  // A tilted surface stretches and shears along the base line, which is mostly the pattern's u; the rest is smaller.
  error << 1 + uniform(-size, size), uniform(-size, size), uniform(-0.5F * size, 0.5F * size),
      1 + uniform(-0.5F * size, 0.5F * size);
  return error;
}

void SymbolViewer::draw_cells(int letter) {
  const int pitch = options_.symbol_size_px + options_.spacing_px;
  cells_ = Grey8(kCells * pitch, kCells * pitch);
  for (int row = 0; row < kCells; ++row) {
    for (int column = 0; column < kCells; ++column) {
      const bool middle = row == 1 && column == 1;
      const Grey8& drawing = drawings_[middle ? static_cast<std::size_t>(letter) : random_() % drawings_.size()];
      for (int y = 0; y < drawing.height(); ++y) {
        std::copy_n(drawing.row(y), drawing.width(),
                    cells_.row(row * pitch + y + options_.spacing_px / 2) + column * pitch + options_.spacing_px / 2);
      }
    }
  }
}

void SymbolViewer::expose(int side_px) {
  const Eigen::Matrix2f inverse = view_.frame.inverse();
  const float middle_of_square =
      static_cast<float>(options_.symbol_size_px + options_.spacing_px + options_.spacing_px / 2) +
      0.5F * static_cast<float>(options_.symbol_size_px);
  light_.assign(static_cast<std::size_t>(side_px) * side_px, 0.F);
  for (int y = 0; y < side_px; ++y) {
    for (int x = 0; x < side_px; ++x) {
      int lit = 0;
      for (int sub = 0; sub < kSubpixels * kSubpixels; ++sub) {
        const Eigen::Vector2f at(static_cast<float>(x) + (static_cast<float>(sub % kSubpixels) - 1) / kSubpixels,
                                 static_cast<float>(y) + (static_cast<float>(sub / kSubpixels) - 1) / kSubpixels);
        const Eigen::Vector2f cell = inverse * (at - view_.middle_px) + Eigen::Vector2f::Constant(middle_of_square);
        if (cell.x() < 0 || cell.y() < 0) continue;
        const int u = static_cast<int>(cell.x()), v = static_cast<int>(cell.y());
        if (u < cells_.width() && v < cells_.height()) lit += cells_.at(u, v);
      }
      light_[y * side_px + x] = static_cast<float>(lit) / (kSubpixels * kSubpixels);
    }
  }
}

// The edge goes on beyond the image.
void SymbolViewer::blur(float sigma_px) {
  const int side = view_.image.width(), reach = static_cast<int>(std::ceil(3 * sigma_px));
  const std::vector<float> weights = gaussian(sigma_px, reach);
  const auto row = [side](std::vector<float>& light, int y) {
    return light.data() + static_cast<std::ptrdiff_t>(y) * side;
  };
  blurred_.assign(light_.size(), 0.F);
  wide_row_.resize(side + 2 * reach);
  for (int y = 0; y < side; ++y) {
    for (int x = -reach; x < side + reach; ++x) wide_row_[x + reach] = row(light_, y)[std::clamp(x, 0, side - 1)];
    for (int i = 0; i <= 2 * reach; ++i) add_scaled(weights[i], wide_row_.data() + i, side, row(blurred_, y));
  }
  light_.assign(light_.size(), 0.F);
  for (int y = 0; y < side; ++y) {
    for (int i = -reach; i <= reach; ++i) {
      add_scaled(weights[i + reach], row(blurred_, std::clamp(y + i, 0, side - 1)), side, row(light_, y));
    }
  }
}

const SymbolView& SymbolViewer::view(int letter, float tilt) {
  draw_cells(letter);
  const float scale = options_.camera_px_per_projector_px;
  Eigen::Matrix2f stretch;
  stretch << 1 + tilt * uniform(-0.4F, 0.15F), 0, 0, 1 + tilt * uniform(-0.25F, 0.15F);
  const float roll = uniform(-0.1F, 0.1F);
  Eigen::Matrix2f turn;
  turn << std::cos(roll), -std::sin(roll), std::sin(roll), std::cos(roll);
  view_.frame = scale * turn * stretch;

  const float size_px = static_cast<float>(options_.symbol_size_px) * scale;
  const int side = static_cast<int>(std::ceil(1.7F * (size_px + static_cast<float>(options_.spacing_px) * scale))) + 6;
  view_.middle_px.setConstant(0.5F * static_cast<float>(side));
  view_.middle_px.x() += uniform(-0.5F, 0.5F);
  view_.middle_px.y() += uniform(-0.5F, 0.5F);
  view_.image = Grey8(side, side);
  view_.mask = Grey8(side, side);
  expose(side);
  blur(uniform(0.5F, std::max(1.1F, 0.07F * size_px)));

  const float noise = uniform(0.F, 6.F);
  for (int i = 0; i < side * side; ++i) {
    const float gauss = uniform(-1, 1) + uniform(-1, 1) + uniform(-1, 1);  // variance 1
    const float level = kDark + (kLight - kDark) * light_[i] + noise * gauss;
    view_.image.data()[i] = static_cast<std::uint8_t>(std::clamp(level, 0.F, 255.F));
    view_.mask.data()[i] = level > kDark + options_.threshold_level * (kLight - kDark) ? 255 : 0;
  }
  return view_;
}

}  // namespace slsd
