// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/appearance/align_blocks.hpp"
#include "core/appearance/align_patches.hpp"
#include "core/appearance/blurred_pattern.hpp"
#include "core/appearance/measure_blur.hpp"
#include "core/executor.hpp"
#include "core/exposure/frame_noise.hpp"
#include "core/geometry/calibration.hpp"
#include "core/geometry/ray_table.hpp"
#include "core/image.hpp"

namespace slsd {

/// A piece of the surface around a camera pixel. On a plane, the inverse depth is linear in the pixels.
struct SurfacePlane {
  float inverse_depth = 0;         ///< 1/mm, along the camera's z axis
  float slope_x = 0, slope_y = 0;  ///< its change for one camera px

  [[nodiscard]] float at(float dx, float dy) const { return inverse_depth + slope_x * dx + slope_y * dy; }
};

/// A known place on the surface, at which growth begins.
struct SurfaceSeed {
  Eigen::Vector2f camera_px;
  SurfacePlane plane;
};

/// The plane that was fitted around one pixel of the grid.
struct SurfaceNode {
  SurfacePlane plane;
  float per_px = 0;                                    ///< 1/mm: the change that moves the pattern by one projector px
  float across = 0;                                    ///< offset of the pattern from its epipolar line, projector px
  float gain = 0, gain_x = 0, gain_y = 0, offset = 0;  ///< grey levels, for one camera px
  float support = 0;                                   ///< the share of its window that agrees with the pattern
  float noise_px = 0, slope_noise = 0;                 ///< one standard deviation from the frame's noise
  float sigma_px = 0;                                  ///< all errors together, projector px
  float residual = 0;                                  ///< root mean square, of the gain
  std::uint8_t blur = 0;                               ///< level of its blur, see BlurredPattern
  bool good = false;
};

/// One frame as the dense stages see it.
struct DenseFrame {
  GreyView pixels;
  double full;  ///< the level of a saturated pixel
  FrameNoise noise;
  float tone_power = 1;  ///< the power of the camera's levels, of which these pixels are the light: see ToneCurve
};

/// Geometry of a camera and its projector, for patches anywhere in the frame.
/// @thread reentrant
struct PatchGeometry {
  CalibratedCamera camera;
  Lens projector;
  RayTable rays;

  PatchGeometry(const CalibratedCamera& of_camera, const Lens& of_projector)
      : camera(of_camera), projector(of_projector), rays(of_camera.lens) {}
};

/// Nodes of a grid that are spaced by several others, from the first whose window lies within the frame.
struct CoarseLattice {
  int step = 1;  ///< nodes from one to the next, along both axes
  int first = 0, columns = 0, rows = 0;

  /// Column or row in the grid.
  [[nodiscard]] int of(int coarse) const { return first + coarse * step; }
};

struct GridOptions {
  int stride_px;
  int window_px;  ///< odd: side of the patch to which a node is fitted
  double depth_min_mm, depth_max_mm;
};

/// The surface on a grid of camera pixels, grown from seeds. Each node is aligned with the pattern, starting from the
/// plane of a known neighbour. Growth proceeds front by front, so the order of parallel work has no effect.
///
///     o   o   o   o   o      o  not reached yet
///     o  (+)-(+)  o   o     (+) the front: starts at its best neighbours' planes, continued
///    (+)-[#]-[#]-(+)  o     [#] fitted, and good
///
/// @thread thread-bound: keeps its buffers
class SurfaceGrid {
 public:
  SurfaceGrid(const PatchGeometry& geometry, const GridOptions& options);

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] int stride_px() const { return options_.stride_px; }
  [[nodiscard]] int window_px() const { return options_.window_px; }
  [[nodiscard]] int x_of(int column) const { return first_ + column * options_.stride_px; }
  [[nodiscard]] int y_of(int row) const { return first_ + row * options_.stride_px; }
  /// Returns a good node; null outside the grid and if no plane fitted.
  [[nodiscard]] const SurfaceNode* good(int column, int row) const {
    if (column < 0 || row < 0 || column >= columns_ || row >= rows_) return nullptr;
    const SurfaceNode& node = nodes_[static_cast<std::size_t>(row) * columns_ + column];
    return node.good ? &node : nullptr;
  }

  /// Map of the pattern around a node, with this frame's offset from its epipolar line.
  [[nodiscard]] PatchMap map_at(int column, int row, double inverse_depth) const {
    return map_of(turned_[static_cast<std::size_t>(row) * columns_ + column].cast<double>(),
                  Eigen::Vector2d(x_of(column), y_of(row)), inverse_depth);
  }
  /// The same around any pixel.
  [[nodiscard]] PatchMap map_around(const Eigen::Vector2d& camera_px, double inverse_depth) const {
    return map_of(turned_by(geometry_->rays.ray(camera_px), geometry_->camera.projector_from_camera), camera_px,
                  inverse_depth);
  }

  /// Measures the blur of the frame at a sample of the seeds, see BlurMeter.
  /// @param pattern  as far as it is known
  [[nodiscard]] BlurSeen look_at_blur(const DenseFrame& frame, const BlurredPattern& pattern,
                                      std::span<const SurfaceSeed> seeds, Executor& executor);
  /// The blur at the samples of the last look_at_blur().
  [[nodiscard]] std::span<const BlurSample> blur_samples() const { return blur_samples_; }

  /// Measures at some seeds how far the pattern lies off its epipolar lines; later alignments start there.
  /// @param again  starts from the present offset, which was measured in this frame, so that one round is enough
  void find_epipolar_offset(const DenseFrame& frame, const BlurredPattern& pattern, std::span<const SurfaceSeed> seeds,
                            bool again, Executor& executor);
  [[nodiscard]] const EpipolarOffset& epipolar_offset() const { return epipolar_; }
  void set_epipolar_offset(const EpipolarOffset& offset) { epipolar_ = offset; }
  [[nodiscard]] std::size_t bytes() const;  ///< memory in use

  /// Forgets every node.
  void clear();
  /// Row by row. Nodes that are good before grow() stay, and growth starts from them.
  [[nodiscard]] std::span<SurfaceNode> nodes() { return nodes_; }
  [[nodiscard]] std::span<const SurfaceNode> nodes() const { return nodes_; }
  /// Marks a node that need not be tried.
  void close(std::size_t node) { attempts_[node] = kClosed; }
  /// Tells whether the node there is good.
  [[nodiscard]] bool good_at(const Eigen::Vector2f& camera_px) const {
    const std::int32_t node = node_at(camera_px);
    return node >= 0 && nodes_[node].good;
  }
  [[nodiscard]] bool is_closed(std::size_t node) const { return attempts_[node] == kClosed; }
  /// Tells whether the node there is neither good nor closed.
  [[nodiscard]] bool open_at(const Eigen::Vector2f& camera_px) const {
    const std::int32_t node = node_at(camera_px);
    return node >= 0 && !nodes_[node].good && attempts_[node] != kClosed;
  }
  /// 1/mm: limits of the search.
  [[nodiscard]] std::pair<double, double> inverse_depths() const {
    return {1 / options_.depth_max_mm, 1 / options_.depth_min_mm};
  }
  [[nodiscard]] std::pair<int, int> frame_px() const {
    return {geometry_->camera.lens.width_px, geometry_->camera.lens.height_px};
  }

  /// Options for aligning nodes: on most objects, light and colour change by some 2 % of the gain for one camera px.
  static constexpr AlignOptions kAlign{.gain_slope_sigma = 0.02F};

  /// Reach of a node in fuse(), in nodes.
  static constexpr int kFuseReach = 2;

  /// Makes a node from a fit, if it is good.
  [[nodiscard]] bool accept(const PatchTask& task, SurfaceNode& node) const;
  /// Returns the places of a row's nodes, for fits of a whole row.
  [[nodiscard]] BlockPlaces places_of(int row) const;

  /// Grows over the nodes of a lattice alone, from the seeds and from its good nodes.
  void grow_coarse(const DenseFrame& frame, const BlurredPattern& pattern, std::span<const SurfaceSeed> seeds,
                   const CoarseLattice& lattice, Executor& executor);
  /// Grows from the seeds and from nodes that have become good since clear().
  void grow(const DenseFrame& frame, const BlurredPattern& pattern, std::span<const SurfaceSeed> seeds,
            Executor& executor);
  /// Continues from more seeds; tries nodes again that failed from elsewhere.
  void grow_on(const DenseFrame& frame, const BlurredPattern& pattern, std::span<const SurfaceSeed> seeds,
               Executor& executor);
  /// Fuses each node with its neighbours if they agree within their noise: they are then one smooth surface, and their
  /// mean is more exact than each. Flat surfaces thus get wide windows. A larger difference adds to sigma.
  void fuse(Executor& executor);
  /// Returns 1 for each good node of a row and 0 for the others, as the last fuse() found them. Rows and columns up to
  /// kFuseReach beyond the grid have 0.
  [[nodiscard]] const float* goods(int row) const;

 private:
  static constexpr std::size_t kBatchNodes = 64;
  static constexpr std::size_t kAlignedAtOnce = 2 * kEight;  // tasks of a batch that a worker aligns together
  static constexpr std::uint8_t kAttemptsMax = 4, kClosed = 255;
  struct Attempt {
    std::int32_t node;
    float cost;
    SurfacePlane start;
    float across, gain, gain_x, gain_y, offset;  // gain 0: unknown
  };
  /// Attempts that one worker aligns together.
  struct Batch {
    std::array<PatchTask, kBatchNodes> tasks;
    std::array<PatchTask*, kBatchNodes> active;
    std::array<std::uint8_t, kBatchNodes> blurs;  // the level of each task's blur
  };
  [[nodiscard]] PatchMap map_of(const Eigen::Matrix3d& turned, const Eigen::Vector2d& camera_px,
                                double inverse_depth) const {
    PatchMap map = make_patch_map(turned, camera_px, geometry_->camera.projector_from_camera.translation,
                                  geometry_->projector, inverse_depth);
    const float off = epipolar_.at(map.middle_px);
    const Eigen::Vector2f across(-off * map.along.y(), off * map.along.x());
    map.base.topRows<2>() += across * map.base.row(2);
    map.shift.head<2>() += across * map.shift.z();
    return map;
  }
  [[nodiscard]] bool begin(const DenseFrame& frame, const Attempt& attempt, PatchTask& task) const;
  void align(const DenseFrame& frame, const PatternField& field, Batch& batch, std::size_t first,
             std::size_t count) const;
  void align_by_blur(const DenseFrame& frame, const BlurredPattern& pattern, Batch& batch, std::size_t first,
                     std::size_t count) const;
  std::size_t align_some(const DenseFrame& frame, const BlurredPattern& pattern, std::span<const SurfaceSeed> seeds,
                         std::size_t first, std::size_t step, Batch& batch, Executor& executor);
  void offer(const Attempt& attempt);
  void offer_seed(std::int32_t index, const SurfaceSeed& seed);
  void forget_attempts();
  void grow_fronts(const DenseFrame& frame, const BlurredPattern& pattern, int step, Executor& executor);
  void offer_neighbours(std::int32_t index, int step);
  [[nodiscard]] std::int32_t node_at(const Eigen::Vector2f& camera_px) const;

  const PatchGeometry* geometry_;
  GridOptions options_;
  int first_, columns_, rows_;
  std::vector<Eigen::Matrix3f> turned_;  // for each node's pixel, see turned_by()
  std::vector<SurfaceNode> nodes_;
  std::vector<float> around_;  // data of the nodes, as fuse() reads them
  std::vector<Attempt> front_, next_;
  std::vector<char> accepted_;          // for the front
  std::vector<std::int32_t> pending_;   // for each node: its place in the next front, or -1
  std::vector<std::uint8_t> attempts_;  // for each node
  std::vector<Batch> batches_;          // one for each worker
  BlurMeter blur_meter_;
  std::vector<BlurSample> blur_samples_;
  EpipolarOffset epipolar_;
  std::vector<Eigen::Vector3f> offsets_;  // for each seed: camera px, offset
};

}  // namespace slsd
