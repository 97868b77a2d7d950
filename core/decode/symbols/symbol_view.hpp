// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include <Eigen/Core>

#include "core/decode/grid/lattice_frame.hpp"
#include "core/image.hpp"

namespace slsd {

struct SymbolViewOptions {
  std::vector<int> symbols;
  int symbol_size_px;
  int spacing_px;
  float camera_px_per_projector_px;
  float threshold_level;         ///< between dark and light
  std::optional<float> noise{};  ///< standard deviation, as a share of the contrast; if missing, all that occurs
  bool drawn = false;            ///< sharper than any lens: pixels may coincide with the pattern's
};

/// Tells whether a frame of this blur is drawn, without a lens.
[[nodiscard]] bool is_drawn(std::optional<float> blur_px);

/// One symbol among its neighbours, as a camera might see it.
struct SymbolView {
  Grey8 image;
  Grey8 mask;                 ///< above the threshold
  LatticeFrame frame;         ///< camera px for one projector px
  Eigen::Vector2f middle_px;  ///< centre of the symbol's square, in the image
};

/// The error of an assumed frame, up to its size.
struct FrameError {
  std::array<float, 4> shares;  ///< shares of its range, one for each entry by rows

  /// A matrix near the identity.
  [[nodiscard]] Eigen::Matrix2f of_size(float size) const;
};

/// Draws symbols in random tilt, blur, noise and position on the pixels, identical in every run. One exposure serves
/// any number of blurs.
/// @thread thread-bound
class SymbolViewer {
 public:
  explicit SymbolViewer(SymbolViewOptions options);

  /// Draws a new look at a letter, still without blur.
  /// @param tilt  0 for a surface that faces the devices, 1 for every tilt that occurs
  void expose(int letter, float tilt);
  /// Blurs the exposure and adds its noise. The result is valid until the next call.
  /// @param blur_px  standard deviation, to a third; if missing, all that occur
  [[nodiscard]] const SymbolView& develop(std::optional<float> blur_px);

  [[nodiscard]] FrameError frame_error();

 private:
  /// std::mt19937's numbers from half the memory, in half the time.
  using Random = std::mersenne_twister_engine<std::uint32_t, 32, 624, 397, 31, 0x9908b0df, 11, 0xffffffff, 7,
                                              0x9d2c5680, 15, 0xefc60000, 18, 1812433253>;
  float share();
  float uniform(float low, float high);
  void draw_cells(int letter);
  void light_pixels(int side_px);
  void draw_noise(int pixels);
  void blur(float sigma_px);
  void add_noise();

  SymbolViewOptions options_;
  Random random_{1};
  std::vector<Grey8> drawings_;
  Grey8 cells_;  // three by three cells, with a dark border of one pixel
  std::vector<float> exposed_, light_, blurred_, wide_row_, tall_;
  float blur_share_ = 0;  // where in the range of blurs
  float noise_ = 0;       // standard deviation, grey levels
  std::vector<std::uint32_t> draws_;
  std::vector<float> noises_;               // for each pixel, in standard deviations
  std::vector<float> column_u_, column_v_;  // contribution of a subpixel's column to its place among the cells
  std::vector<std::int32_t> pixels_;        // pattern pixels under a row's subpixels
  std::vector<int> lit_;                    // sums of a row's pixels
  SymbolView view_;
};

}  // namespace slsd
