// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <random>
#include <vector>

#include <Eigen/Core>

#include "core/decode/lattice_frame.hpp"
#include "core/image.hpp"

namespace slsd {

struct SymbolViewOptions {
  std::vector<int> symbols;
  int symbol_size_px;
  int spacing_px;
  float camera_px_per_projector_px;
  float threshold_level;  ///< between dark and light
};

/// One symbol among its neighbours, as a camera might see it.
struct SymbolView {
  Grey8 image;
  Grey8 mask;                 ///< above the threshold
  LatticeFrame frame;         ///< camera px for one projector px
  Eigen::Vector2f middle_px;  ///< of the symbol's square, in the image
};

/// Draws symbols in random tilt, blur, noise and position on the pixels, the same in every run.
/// @thread thread-bound
class SymbolViewer {
 public:
  explicit SymbolViewer(SymbolViewOptions options);

  /// A new look at a letter. The result stands until the next call.
  /// @param tilt  0 for a surface that faces the devices, 1 for every tilt that occurs
  [[nodiscard]] const SymbolView& view(int letter, float tilt);

  /// A random matrix near the identity, the error of an assumed frame.
  [[nodiscard]] Eigen::Matrix2f frame_error(float size);

 private:
  float uniform(float low, float high);
  void draw_cells(int letter);
  void expose(int side_px);
  void blur(float sigma_px);

  SymbolViewOptions options_;
  std::mt19937 random_{1};
  std::vector<Grey8> drawings_;
  Grey8 cells_;  // three by three cells
  std::vector<float> light_, blurred_, wide_row_;
  SymbolView view_;
};

}  // namespace slsd
