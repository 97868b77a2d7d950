// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/symbol_look.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "core/code/look_measure.hpp"
#include "core/code/symbol.hpp"

namespace slsd {
namespace {

constexpr int kCells = 3;
constexpr int kSubpixels = 3;
constexpr double kLargestRoll_rad = 0.1;
constexpr double kLowestThreshold = 0.4;  // a local threshold follows what is around it
constexpr double kHighestThreshold = 0.5;

std::vector<double> gaussian_kernel(double sigma_px) {
  const int reach = static_cast<int>(std::ceil(3 * sigma_px));
  std::vector<double> kernel;
  double sum = 0;
  for (int i = -reach; i <= reach; ++i) sum += kernel.emplace_back(std::exp(-0.5 * i * i / (sigma_px * sigma_px)));
  for (double& weight : kernel) weight /= sum;
  return kernel;
}

}  // namespace

SymbolObserver::SymbolObserver(LookOptions options, const std::vector<int>& neighbours, std::uint32_t seed)
    : options_(options), twister_(seed) {
  for (const int number : neighbours) neighbours_.push_back(draw_symbol(number, options_.symbol_size_px));
  const int pitch_px = options_.symbol_size_px + options_.spacing_px;
  cells_ = Grey8(kCells * pitch_px, kCells * pitch_px);
  const int side_px = static_cast<int>(std::ceil(2.2 * pitch_px * options_.camera_px_per_projector_px)) + 4;
  light_ = Image<double>(side_px, side_px);
}

double SymbolObserver::uniform(double low, double high) {
  return low + (high - low) * static_cast<double>(twister_()) * 0x1p-32;
}

void SymbolObserver::lay_cells(int number) {
  const int pitch_px = options_.symbol_size_px + options_.spacing_px;
  const Grey8 middle = draw_symbol(number, options_.symbol_size_px);
  for (int cell = 0; cell < kCells * kCells; ++cell) {
    const Grey8& drawing = cell == kCells * kCells / 2 ? middle : neighbours_[twister_() % neighbours_.size()];
    const int left = cell % kCells * pitch_px + options_.spacing_px / 2;
    const int top = cell / kCells * pitch_px + options_.spacing_px / 2;
    for (int y = 0; y < drawing.height(); ++y) std::copy_n(drawing.row(y), drawing.width(), cells_.row(top + y) + left);
  }
}

// Tilt shortens; along the base line, the pattern's u, a surface may also turn towards the camera and look longer.
Eigen::Matrix2d SymbolObserver::random_view() {
  const double roll = uniform(-kLargestRoll_rad, kLargestRoll_rad);
  Eigen::Matrix2d turn;
  turn << std::cos(roll), -std::sin(roll), std::sin(roll), std::cos(roll);
  const Eigen::Vector2d stretch(uniform(0.75, 1.1), uniform(0.85, 1.1));
  return options_.camera_px_per_projector_px * turn * stretch.asDiagonal();
}

Eigen::Matrix2d SymbolObserver::random_frame_error() {
  Eigen::Matrix2d error = Eigen::Matrix2d::Identity();
  for (int i = 0; i < 4; ++i) error(i / 2, i % 2) += uniform(-options_.frame_error, options_.frame_error);
  return error;
}

void SymbolObserver::expose(const Eigen::Matrix2d& camera_from_pattern) {
  const Eigen::Matrix2d pattern_from_camera = camera_from_pattern.inverse();
  const int pitch_px = options_.symbol_size_px + options_.spacing_px;
  const Eigen::Vector2d middle =
      Eigen::Vector2d::Constant(pitch_px + options_.spacing_px / 2 + 0.5 * options_.symbol_size_px);
  for (int y = 0; y < light_.height(); ++y) {
    for (int x = 0; x < light_.width(); ++x) {
      int lit = 0;
      for (int sub = 0; sub < kSubpixels * kSubpixels; ++sub) {
        const Eigen::Vector2d at(x + (sub % kSubpixels - 1.0) / kSubpixels, y + (sub / kSubpixels - 1.0) / kSubpixels);
        const Eigen::Vector2d in_cells = pattern_from_camera * (at - middle_px_) + middle;
        const int u = static_cast<int>(std::floor(in_cells.x()));
        const int v = static_cast<int>(std::floor(in_cells.y()));
        if (cells_.view().contains(u, v)) lit += cells_.at(u, v);
      }
      light_.at(x, y) = static_cast<double>(lit) / (kSubpixels * kSubpixels);
    }
  }
}

Image<double> SymbolObserver::blurred_along(const Image<double>& from, const std::vector<double>& kernel, int step_x,
                                            int step_y) const {
  const int reach = static_cast<int>(kernel.size() / 2);
  Image<double> to(from.width(), from.height());
  for (int y = 0; y < from.height(); ++y)
    for (int x = 0; x < from.width(); ++x)
      for (int i = -reach; i <= reach; ++i)
        to.at(x, y) +=
            kernel[static_cast<std::size_t>(i + reach)] *
            from.at(std::clamp(x + i * step_x, 0, from.width() - 1), std::clamp(y + i * step_y, 0, from.height() - 1));
  return to;
}

void SymbolObserver::blur(double sigma_px) {
  const std::vector<double> kernel = gaussian_kernel(sigma_px);
  light_ = blurred_along(blurred_along(light_, kernel, 1, 0), kernel, 0, 1);
}

void SymbolObserver::add_noise() {
  for (std::size_t i = 0; i < light_.size(); ++i)
    light_.data()[i] += options_.noise * (uniform(-1, 1) + uniform(-1, 1) + uniform(-1, 1));  // variance 1
}

std::optional<LookFeatures> SymbolObserver::look_at(int number) {
  lay_cells(number);
  const Eigen::Matrix2d camera_from_pattern = random_view();
  middle_px_ =
      Eigen::Vector2d::Constant(0.5 * light_.width()) + Eigen::Vector2d(uniform(-0.5, 0.5), uniform(-0.5, 0.5));
  expose(camera_from_pattern);
  blur(options_.blur_px * uniform(0.8, 1.2));
  add_noise();
  const Eigen::Matrix2d assumed = camera_from_pattern * random_frame_error();
  const double threshold = uniform(kLowestThreshold, kHighestThreshold);
  return measure_look(light_, {middle_px_, camera_from_pattern, assumed, threshold, options_});
}

}  // namespace slsd
