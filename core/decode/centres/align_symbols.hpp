// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/appearance/align_patches.hpp"
#include "core/appearance/blurred_pattern.hpp"
#include "core/appearance/measure_blur.hpp"
#include "core/appearance/pattern_field.hpp"
#include "core/appearance/tone_curve.hpp"
#include "core/code/pattern.hpp"
#include "core/decode/grid/cell_rays.hpp"
#include "core/decode/lattice.hpp"
#include "core/exposure/frame_noise.hpp"
#include "core/image.hpp"

namespace slsd {

/// A symbol's position after its patch was aligned with the pattern.
struct AlignedSymbol {
  Eigen::Vector3d point_in_camera;  ///< mm: the surface point that the symbol's centroid in the projector lights
  Eigen::Vector2f centre_px;        ///< its image in the camera
  /// Standard deviation along the camera's ray. It covers noise, relief within the patch (its parts' disparities
  /// scatter), and disagreement with the neighbours' planes. It also covers missing parts of the pattern, and changes
  /// of light.
  float sigma_mm;
  bool whole;  ///< the whole symbol is visible and agrees with the pattern
};

/// Standard deviation of an aligned patch's position from noise, from relief within it, and from its missing parts,
/// projector px. Fitted to rendered frames (docs/notes/2026-11-decoder.md).
/// @param variance  variance of the disparity, from the residual, px^2
/// @param scatter   scatter of the disparities of the patch's parts, px
/// @param support   the share of the patch that agrees with the pattern
[[nodiscard]] float aligned_sigma_px(float variance, float scatter, float support);
/// Smallest share of the patch that agrees if the whole symbol is visible.
inline constexpr float kWholeSupportMin = 0.55F;

/// Aligns each symbol of a lattice with the pattern: its depth, its tilt, and the light on it.
/// @thread thread-bound: keeps its buffers; the pattern is shared with copies
class SymbolAligner {
 public:
  SymbolAligner(const Pattern& pattern, const CalibratedCamera& camera, const Lens& projector);

  /// @param rays       one for each symbol: the ray of its centre
  /// @param depths_mm  one for each symbol, along the camera's z axis, as triangulated from its centre
  /// @param noise      one standard deviation of a pixel, grey levels
  /// @return           one for each symbol; valid until the next call
  [[nodiscard]] const std::vector<AlignedSymbol>& align(const GreyView& frame, double full, const FrameNoise& noise,
                                                        const Lattice& lattice, std::span<const PixelRay> rays,
                                                        std::span<const double> depths_mm, const CellRays& cells);

 private:
  /// A frame's pixels, or the light of them, and the level of a saturated pixel.
  struct Developed {
    GreyView pixels;
    double full;
  };
  [[nodiscard]] CellTask cell_of(const LatticeSymbol& symbol, const PixelRay& ray, double depth_mm) const;
  [[nodiscard]] Developed develop(const Developed& frame, const FrameNoise& noise, const Lattice& lattice);
  [[nodiscard]] BlurSeen look_at_blur(const Developed& light, const BlurredPattern& pattern);
  void align_by_blur(const Developed& light, const BlurredPattern& pattern, std::span<CellTask> cells);
  void try_neighbours(const Developed& light, const BlurredPattern& pattern, const Lattice& lattice);
  [[nodiscard]] AlignedSymbol point_of(const Lattice& lattice, std::size_t index, const PixelRay& ray,
                                       const Eigen::Vector2f& projector_px) const;
  [[nodiscard]] float disagreement_px(const Lattice& lattice, std::size_t index) const;

  CalibratedCamera camera_;
  Lens projector_;
  PatternOptions options_;
  float pitch_px_, half_px_;
  std::shared_ptr<const PatternFields> fields_;
  std::vector<CellTask> cells_, sample_, again_, of_blur_;
  std::vector<std::size_t> again_for_;  // for each of again_: index of its symbol
  std::vector<AlignedSymbol> aligned_;
  BlurMeter blur_meter_;
  std::vector<BlurSample> blur_samples_;
  ToneCurve tone_;
};

}  // namespace slsd
