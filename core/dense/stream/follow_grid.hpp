// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "core/appearance/blurred_pattern.hpp"
#include "core/dense/dense_map.hpp"
#include "core/dense/nodes/surface_grid.hpp"
#include "core/dense/stream/followed_frame.hpp"
#include "core/executor.hpp"

namespace slsd {

/// Continues a grid's planes from frame to frame while the scene stands still, at a small part of the cost of
/// alignment. If a frame I differs little from a measured frame I0, the aligner's model is linear, and its
/// least-squares solution moves by
///
///     N^-1 sum J (I - I0),  N = sum J J^T plus the prior
///
/// over a node's window, with J the model's derivatives. These depend only on the surface and are kept, so a new frame
/// needs sums only. The result has the new frame's noise, not that of I0.
///
/// Two kinds of node are aligned as in any frame. Either its window changed by more than noise and its plane's move
/// explain, or its plane moved beyond the linear range. So prediction saves time, and decides nothing.
/// @thread thread-bound: keeps its buffers; another() makes one for another thread, which shares the followed frame
class GridFollower {
 public:
  /// @param window_px  side of a node's window, as in GridOptions
  explicit GridFollower(int window_px) : window_px_(window_px), shared_(std::make_shared<Shared>()) {}
  /// Makes a follower for another thread that measures frames of the same camera.
  [[nodiscard]] GridFollower another() const { return {window_px_, shared_}; }

  /// The tone of the frame that the next one may continue, see DenseFrame.
  [[nodiscard]] float tone_power() const;
  /// Begins a frame: gives the grid the nodes that continue, and closes nodes that failed before on the same pixels.
  /// @return the frame that they continue; null if most do not, and the grid starts afresh
  [[nodiscard]] std::shared_ptr<const FollowedFrame> follow(const DenseFrame& frame, SurfaceGrid& grid,
                                                            Executor& executor);

  /// Keeps a frame, once the grid has grown and before it is fused. It does so if more nodes stand still since the
  /// previous frame than continued. The next frames are then compared with this one.
  /// @param pattern, found  see FollowedFrame
  void keep(const DenseFrame& frame, const BlurredPattern& pattern, const SurfaceGrid& grid,
            std::span<const SurfaceSeed> found, Executor& executor);

  /// Ends the frame: only nodes at which the map has a point continue.
  void finish(const DenseMap& map, const SurfaceGrid& grid);

  /// Frees shared memory: no frame continues until another is kept. @thread reentrant
  void forget() {
    const std::lock_guard lock(shared_->mutex);
    shared_->frame.reset();
  }
  /// Number of nodes that continued in the last frame.
  [[nodiscard]] std::size_t followed() const { return followed_; }
  /// Mean move of the last frame's nodes across the epipolar lines, projector px; 0 if none continued.
  [[nodiscard]] float across_px() const { return across_px_; }
  [[nodiscard]] std::size_t bytes() const;  ///< memory in use, including shared memory

 private:
  struct Shared {
    std::mutex mutex;
    std::shared_ptr<const FollowedFrame> frame;
  };
  GridFollower(int window_px, std::shared_ptr<Shared> shared) : window_px_(window_px), shared_(std::move(shared)) {}

  struct Moved {
    float square = 0, by_noise = 0;  // square of a plane's move, and its expectation from noise
    float across_px = 0;             // off the epipolar line
  };
  float stop_what_moves(SurfaceGrid& grid, bool sampled);
  void follow_row(const DenseFrame& frame, const FollowedFrame& from, SurfaceGrid& grid, int row, int worker);
  [[nodiscard]] double still_share(const DenseFrame& frame, const SurfaceGrid& grid) const;

  int window_px_;
  std::shared_ptr<Shared> shared_;
  std::vector<std::uint16_t> last_;          // the pixels of the previous frame; empty if there was none
  std::vector<std::vector<float>> columns_;  // sums over a row of windows, one for each worker
  std::vector<Moved> moves_;                 // for each node
  std::shared_ptr<FollowedFrame> kept_;      // the kept frame, until it is finished
  std::size_t followed_ = 0;
  float across_px_ = 0;
};

}  // namespace slsd
