// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <random>
#include <vector>

#include <Eigen/Core>

#include "core/image.hpp"

namespace slsd {

inline constexpr int kLookFeatures = 8;

/// Area, second and third central moments over the area of a symbol as a camera sees it, in units of the symbol's side:
/// (area, m20, m11, m02, m30, m21, m12, m03).
using LookFeatures = Eigen::Matrix<double, kLookFeatures, 1>;

/// Under what circumstances a symbol is looked at.
struct LookOptions {
  int symbol_size_px = 16;
  int spacing_px = 2;
  double camera_px_per_projector_px = 1.4;  ///< 1.4: camera 1600 px and projector 1280 px wide on the paper's rig
  double blur_px = 1.1;                     ///< standard deviation of the blur of projector and camera, camera px
  double noise = 0.02;                      ///< standard deviation, as a share of the contrast
  int looks = 160;                          ///< at each symbol
  double frame_error = 0.07;  ///< largest error of the grid vectors that a look is measured by, as a share of them
};

/// Shows a symbol among random neighbours to a simulated camera: tilt, roll, blur, position on the pixels, noise; then
/// measures it as a decoder would, by a soft threshold on grey values and grid vectors that are not quite right.
/// @thread thread-bound
class SymbolObserver {
 public:
  /// @param neighbours  symbol numbers that stand around the one that is looked at
  SymbolObserver(LookOptions options, const std::vector<int>& neighbours, std::uint32_t seed);

  /// @param number  the symbol to look at, 1 to 25
  /// @return        empty where the symbol broke into pieces or grew together with a neighbour
  [[nodiscard]] std::optional<LookFeatures> look_at(int number);

 private:
  double uniform(double low, double high);
  void lay_cells(int number);
  void expose(const Eigen::Matrix2d& camera_from_pattern);
  void blur(double sigma_px);
  void add_noise();
  [[nodiscard]] Eigen::Matrix2d random_view();
  [[nodiscard]] Eigen::Matrix2d random_frame_error();
  [[nodiscard]] Image<double> blurred_along(const Image<double>& from, const std::vector<double>& kernel, int step_x,
                                            int step_y) const;

  LookOptions options_;
  std::mt19937 twister_;
  std::vector<Grey8> neighbours_;
  Grey8 cells_;
  Image<double> light_;
  Eigen::Vector2d middle_px_;
};

}  // namespace slsd
