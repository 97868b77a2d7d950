// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/pixels/occlusion.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include <Eigen/Geometry>

#include "core/clones.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

/// Ratio of distances from the projector: a point farther away by more is on another surface.
constexpr float kBehind = 1.01F;
/// Side of a tile, camera px, and of a cell, projector px.
constexpr int kTilePx = RayGrid::kPitchPx, kCellPx = 8;
constexpr std::size_t kTilePixels = kTilePx * kTilePx;
static_assert(kTilePx == kLanes);
/// Added around a tile's box, projector px: a lens bends the lines between its corners by less.
constexpr float kMarginPx = 2;

/// Eight pixels of a row, and the projector pixels that light them.
struct Rays {
  float turned[3], per_px[3];  // R r of the first pixel, and its change for one px
  float translation[3];
  float fx, fy, cx, cy, distortion[5];
  int width, height;  // size of the projector's image
};

/// Projects points. @param u, v  half a pixel more, so that the whole part is the pixel
inline __attribute__((always_inline)) void find_pixel(const Rays& in, const Lanes* q, Lanes& u, Lanes& v) {
  const Lanes x = q[0] / q[2], y = q[1] / q[2], r2 = x * x + y * y;
  const float k1 = in.distortion[0], k2 = in.distortion[1], p1 = in.distortion[2], p2 = in.distortion[3],
              k3 = in.distortion[4];
  const Lanes radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  u = in.fx * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + (in.cx + 0.5F);
  v = in.fy * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + (in.cy + 0.5F);
}

/// @param to  the projector's pixel, -1 if there is none, and the distance from the projector along its z axis
inline __attribute__((always_inline)) void find_rays(const Rays& in, const float* depth_mm, std::int32_t* to,
                                                     float* distance_mm) {
  const Lanes zero{};
  Lanes depth, q[3];
  load(depth_mm, depth);
  for (int k = 0; k < 3; ++k) q[k] = depth * (in.turned[k] + in.per_px[k] * kLane) + in.translation[k];
  Lanes u, v;
  find_pixel(in, q, u, v);
  // NaN is in no range.
  const IntLanes inside = (u >= zero) & (v >= zero) & (u < zero + static_cast<float>(in.width)) &
                          (v < zero + static_cast<float>(in.height)) & (q[2] > zero);
  const Lanes safe_u = inside ? u : zero, safe_v = inside ? v : zero;
  const IntLanes at = __builtin_convertvector(safe_v, IntLanes) * in.width + __builtin_convertvector(safe_u, IntLanes);
  const IntLanes found = inside ? at : IntLanes{} - 1;
  std::memcpy(to, &found, sizeof found), std::memcpy(distance_mm, &q[2], sizeof q[2]);
}

/// Smallest and largest depth of a tile; the former is the greater if there is none.
struct Depths {
  float least, most;
};
inline __attribute__((always_inline)) void find_depths(const float* depth_mm, std::ptrdiff_t width, int rows,
                                                       Depths& to) {
  Lanes least = Lanes{} + std::numeric_limits<float>::max(), most = Lanes{};
  for (int row = 0; row < rows; ++row) {
    Lanes depth;
    load(depth_mm + row * width, depth);
    // NaN is neither less nor more.
    least = depth < least ? depth : least;
    most = depth > most ? depth : most;
  }
  to = {least[0], most[0]};
  for (int lane = 1; lane < kLanes; ++lane) to = {std::min(to.least, least[lane]), std::max(to.most, most[lane])};
}

/// The box of a tile in the projector's image: corners at the smallest and the largest depth, one in each lane.
struct Box {
  float left, top, right, bottom, nearest, farthest;
};
inline __attribute__((always_inline)) void find_box(const Rays& in, const float* turned, const Depths& depths,
                                                    Box& to) {
  Lanes depth, q[3], u, v;
  for (int lane = 0; lane < kLanes; ++lane) {
    depth[lane] = lane < kLanes / 2 ? depths.least : depths.most;
    for (int k = 0; k < 3; ++k) q[k][lane] = turned[3 * (lane % 4) + k];
  }
  for (int k = 0; k < 3; ++k) q[k] = depth * q[k] + in.translation[k];
  find_pixel(in, q, u, v);
  to = {u[0], v[0], u[0], v[0], q[2][0], q[2][0]};
  for (int lane = 1; lane < kLanes; ++lane) {
    to.left = std::min(to.left, u[lane]), to.right = std::max(to.right, u[lane]);
    to.top = std::min(to.top, v[lane]), to.bottom = std::max(to.bottom, v[lane]);
    to.nearest = std::min(to.nearest, q[2][lane]), to.farthest = std::max(to.farthest, q[2][lane]);
  }
}

Rays rays_of(const CalibratedCamera& camera, const Lens& projector) {
  Rays rays{};
  Eigen::Map<Eigen::Vector3f>(rays.translation) = camera.projector_from_camera.translation.cast<float>();
  rays.fx = static_cast<float>(projector.fx), rays.fy = static_cast<float>(projector.fy);
  rays.cx = static_cast<float>(projector.cx), rays.cy = static_cast<float>(projector.cy);
  for (int k = 0; k < 5; ++k) rays.distortion[k] = static_cast<float>(projector.distortion[k]);
  rays.width = projector.width_px, rays.height = projector.height_px;
  return rays;
}

}  // namespace

Occlusion::Occlusion(const CalibratedCamera& camera, const Lens& projector, std::shared_ptr<const RayGrid> rays)
    : camera_(camera),
      projector_(projector),
      rays_(std::move(rays)),
      columns_((projector.width_px + kCellPx - 1) / kCellPx),
      rows_((projector.height_px + kCellPx - 1) / kCellPx) {}

std::size_t Occlusion::bytes() const {
  const auto of = [](const auto& held) { return held.capacity() * sizeof held[0]; };
  return of(tiles_) + of(cell_nearest_) + of(cell_farthest_) + of(pixel_) + of(distance_) + of(nearest_);
}

Occlusion::Tile Occlusion::tile_at(const DenseMap& map, int column, int row) const {
  const int x = column * kTilePx, y = row * kTilePx, height = std::min(kTilePx, map.height - y);
  const float* depth = map.depth_mm.data() + static_cast<std::size_t>(y) * map.width + x;
  Depths depths{};
  if (x + kTilePx <= map.width) {
    Cloned<find_depths>::call(depth, map.width, height, depths);
  } else {
    depths = {std::numeric_limits<float>::max(), 0};
    for (int down = 0; down < height; ++down)
      for (int right = 0; right < map.width - x; ++right)
        if (const float here = depth[down * map.width + right]; here > 0)
          depths = {std::min(depths.least, here), std::max(depths.most, here)};
  }
  Tile tile;
  if (depths.least > depths.most) return tile;
  const Eigen::Matrix3f turn = camera_.projector_from_camera.rotation.cast<float>();
  float turned[3 * 4];
  for (int corner = 0; corner < 4; ++corner)
    Eigen::Map<Eigen::Vector3f>(turned + 3 * corner) =
        turn * rays_->node(column + corner % 2, row + corner / 2).homogeneous();
  Box box;
  Cloned<find_box>::call(rays_of(camera_, projector_), turned, depths, box);
  const auto width = static_cast<float>(projector_.width_px), tall = static_cast<float>(projector_.height_px);
  if (!(box.nearest > 0)) {
    // Behind the projector a box says nothing.
    return {0, 0, columns_ - 1, rows_ - 1, 0, std::numeric_limits<float>::max(), true};
  }
  box.left -= kMarginPx, box.top -= kMarginPx, box.right += kMarginPx, box.bottom += kMarginPx;
  const auto cell = [](float px, float size, int count) {
    return std::min(static_cast<int>(std::clamp(px, 0.F, size)) / kCellPx, count - 1);
  };
  tile = {cell(box.left, width, columns_),
          cell(box.top, tall, rows_),
          cell(box.right, width, columns_),
          cell(box.bottom, tall, rows_),
          box.nearest,
          box.farthest,
          !(box.left >= 0 && box.top >= 0 && box.right <= width && box.bottom <= tall)};
  return tile;
}

void Occlusion::find_tiles(const DenseMap& map, Executor& executor) {
  tile_columns_ = (map.width + kTilePx - 1) / kTilePx, tile_rows_ = (map.height + kTilePx - 1) / kTilePx;
  tiles_.resize(static_cast<std::size_t>(tile_columns_) * tile_rows_);
  executor.run(tile_rows_, [&](int row, int) {
    for (int column = 0; column < tile_columns_; ++column)
      tiles_[static_cast<std::size_t>(row) * tile_columns_ + column] = tile_at(map, column, row);
  });
}

/// Marks the tiles in cells with two surfaces.
void Occlusion::find_conflicts() {
  const std::size_t cells = static_cast<std::size_t>(columns_) * rows_;
  cell_nearest_.assign(cells, std::numeric_limits<float>::max()), cell_farthest_.assign(cells, 0);
  const auto each_cell = [&](const Tile& tile, const auto& take) {
    for (int row = tile.top; row <= tile.bottom; ++row)
      for (int column = tile.left; column <= tile.right; ++column)
        take(static_cast<std::size_t>(row) * columns_ + column);
  };
  for (const Tile& tile : tiles_) {
    each_cell(tile, [&](std::size_t cell) {
      cell_nearest_[cell] = std::min(cell_nearest_[cell], tile.nearest);
      cell_farthest_[cell] = std::max(cell_farthest_[cell], tile.farthest);
    });
  }
  for (Tile& tile : tiles_) {
    each_cell(tile, [&](std::size_t cell) {
      tile.exact = tile.exact || cell_farthest_[cell] > kBehind * cell_nearest_[cell];
    });
  }
}

/// Makes room for the pixels of the exact tiles, which are a small part of most frames.
void Occlusion::place_exact_tiles() {
  std::size_t count = 0;
  for (Tile& tile : tiles_)
    if (tile.exact) tile.first = std::exchange(count, count + kTilePixels);
  pixel_.resize(count), distance_.resize(count);
}

void Occlusion::project_pixels(const DenseMap& map, int row) {
  const Eigen::Matrix3f turn = camera_.projector_from_camera.rotation.cast<float>();
  Rays here = rays_of(camera_, projector_);
  for (int column = 0; column < tile_columns_; ++column) {
    const Tile& tile = tiles_[static_cast<std::size_t>(row) * tile_columns_ + column];
    if (!tile.exact) continue;
    const int x = column * kTilePx, count = std::min(kTilePx, map.width - x);
    for (int y = row * kTilePx; y < std::min(map.height, (row + 1) * kTilePx); ++y) {
      const Eigen::Vector2f first = rays_->at(x, y), last = rays_->before_next(x, y);
      Eigen::Map<Eigen::Vector3f>(here.turned) = turn * first.homogeneous();
      Eigen::Map<Eigen::Vector3f>(here.per_px) = turn.leftCols<2>() * (last - first) / (RayGrid::kPitchPx - 1);
      const std::size_t to = tile.first + static_cast<std::size_t>(y % kTilePx) * kTilePx;
      float depth[kLanes];
      std::fill(depth, depth + kLanes, std::numeric_limits<float>::quiet_NaN());
      std::copy_n(map.depth_mm.data() + static_cast<std::size_t>(y) * map.width + x, count, depth);
      Cloned<find_rays>::call(here, depth, pixel_.data() + to, distance_.data() + to);
    }
  }
}

template <class Take>
void Occlusion::for_each_exact(const DenseMap& map, const Take& take) const {
  for (int row = 0; row < tile_rows_; ++row) {
    for (int column = 0; column < tile_columns_; ++column) {
      const Tile& tile = tiles_[static_cast<std::size_t>(row) * tile_columns_ + column];
      if (!tile.exact) continue;
      const int left = column * kTilePx, top = row * kTilePx;
      const int right = std::min(map.width, left + kTilePx), bottom = std::min(map.height, top + kTilePx);
      for (int y = top; y < bottom; ++y)
        for (int x = left; x < right; ++x)
          take(static_cast<std::size_t>(y) * map.width + x,
               tile.first + static_cast<std::size_t>((y - top) * kTilePx + x - left));
    }
  }
}

void Occlusion::drop_occluded(DenseMap& map, Executor& executor) {
  nearest_.resize(static_cast<std::size_t>(projector_.width_px) * projector_.height_px);
  find_tiles(map, executor);
  find_conflicts();
  place_exact_tiles();
  executor.run(tile_rows_, [&](int row, int) { project_pixels(map, row); });
  for_each_exact(map, [&](std::size_t, std::size_t at) {
    if (pixel_[at] >= 0) nearest_[pixel_[at]] = std::numeric_limits<float>::max();
  });
  for_each_exact(map, [&](std::size_t, std::size_t at) {
    if (pixel_[at] < 0) return;
    float& nearest = nearest_[pixel_[at]];
    nearest = std::min(nearest, distance_[at]);
  });
  for_each_exact(map, [&](std::size_t pixel, std::size_t at) {
    if (pixel_[at] >= 0 && distance_[at] > kBehind * nearest_[pixel_[at]]) map.drop(pixel, DensePixel::kOccluded);
  });
}

void Occlusion::drop_beyond_the_light(DenseMap& map) const {
  for_each_exact(map, [&](std::size_t pixel, std::size_t at) {
    if (pixel_[at] < 0 && map.measured(pixel)) map.drop(pixel, DensePixel::kUnlit);
  });
}

}  // namespace slsd
