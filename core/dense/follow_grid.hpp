// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "core/align/pattern_field.hpp"
#include "core/dense/dense_map.hpp"
#include "core/dense/followed_frame.hpp"
#include "core/dense/surface_grid.hpp"
#include "core/executor.hpp"

namespace slsd {

/// Carries a grid's planes on from frame to frame where the scene stands still, at a small part of what aligning them
/// costs. Where a frame I differs by little from one that was measured, I0, the aligner's model is linear, and its
/// least squares move by
///
///     N^-1 sum J (I - I0),  N = sum J J^T and what is known beforehand
///
/// over a node's window, J the model's derivatives. These hang on the surface alone: they are kept, and of a new frame
/// only sums are made. What comes of it has the new frame's noise, not that of I0.
///
/// A node whose window has changed by more than noise, beyond what its plane's move explains, or whose plane moves
/// farther than the model is linear, is aligned as in any frame. So prediction saves time, and decides nothing.
/// @thread thread-bound: keeps its buffers; what another() makes is for another thread, and shares the followed frame
class GridFollower {
 public:
  /// @param window_px  of a node, as GridOptions has it
  explicit GridFollower(int window_px) : window_px_(window_px), shared_(std::make_shared<Shared>()) {}
  /// Makes a follower for another thread that measures frames of the same camera.
  [[nodiscard]] GridFollower another() const { return {window_px_, shared_}; }

  /// Begins a frame: gives the grid those nodes that go on, and closes those that have been tried on the same pixels
  /// in vain.
  /// @return what they go on from; null where most do not, and the grid begins from nothing
  [[nodiscard]] std::shared_ptr<const FollowedFrame> follow(const DenseFrame& frame, SurfaceGrid& grid,
                                                            Executor& executor);

  /// Keeps a frame, once the grid has grown and is not fused yet. It does so if more stands still since the frame
  /// before than went on; the next frames are then compared with this one.
  /// @param blur, found  see FollowedFrame
  void keep(const DenseFrame& frame, const PatternField& field, std::size_t blur, const SurfaceGrid& grid,
            std::span<const SurfaceSeed> found, Executor& executor);

  /// Ends it: of the nodes only those go on where the map has a point.
  void finish(const DenseMap& map, const SurfaceGrid& grid);

  /// Gives back what is shared: no frame is gone on from until another is kept. @thread reentrant
  void forget() {
    const std::lock_guard lock(shared_->mutex);
    shared_->frame.reset();
  }
  /// Number of nodes that went on in the last frame.
  [[nodiscard]] std::size_t followed() const { return followed_; }
  /// Mean move of the last frame's nodes across the epipolar lines, projector px; 0 if none went on.
  [[nodiscard]] float across_px() const { return across_px_; }
  [[nodiscard]] std::size_t bytes() const;  ///< memory that it holds, with what is shared

 private:
  struct Shared {
    std::mutex mutex;
    std::shared_ptr<const FollowedFrame> frame;
  };
  GridFollower(int window_px, std::shared_ptr<Shared> shared) : window_px_(window_px), shared_(std::move(shared)) {}

  struct Moved {
    float square = 0, by_noise = 0;  // of what a plane moved, and what is expected of it
    float across_px = 0;             // off the epipolar line
  };
  void stop_what_moves(SurfaceGrid& grid);
  void follow_row(const DenseFrame& frame, const FollowedFrame& from, SurfaceGrid& grid, int row, int worker);
  [[nodiscard]] double still_share(const DenseFrame& frame, const SurfaceGrid& grid) const;

  int window_px_;
  std::shared_ptr<Shared> shared_;
  std::vector<std::uint16_t> last_;          // the pixels of the frame before; empty: there was none
  std::vector<std::vector<float>> columns_;  // sums over a row of windows, one to a worker
  std::vector<Moved> moves_;                 // of the nodes
  std::shared_ptr<FollowedFrame> kept_;      // until it is finished
  std::size_t followed_ = 0;
  float across_px_ = 0;
};

}  // namespace slsd
