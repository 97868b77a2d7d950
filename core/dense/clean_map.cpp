// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/clean_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

#include <Eigen/Geometry>

namespace slsd {
namespace {

/// Of the depth, from a pixel to the next: more is a jump.
constexpr float kJump = 0.004F;
/// Of the distance from the projector: what lies farther behind is another surface.
constexpr float kBehind = 1.01F;

bool is_jump(float a, float b) {
  return std::isnan(a) != std::isnan(b) || std::abs(a - b) > kJump * a;
}

}  // namespace

MapCleaner::MapCleaner(const CalibratedCamera& camera, const Lens& projector, std::shared_ptr<const RayGrid> rays)
    : camera_(camera), projector_(projector), rays_(std::move(rays)) {}

void MapCleaner::drop_occluded(DenseMap& map, Executor& executor) {
  const int width = projector_.width_px, height = projector_.height_px;
  label_.assign(map.depth_mm.size(), -1);
  distance_.resize(map.depth_mm.size());
  nearest_.assign(static_cast<std::size_t>(width) * height, std::numeric_limits<float>::max());
  executor.run(map.height, [&](int y, int) {
    for (int x = 0; x < map.width; ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * map.width + x;
      if (!map.measured(pixel)) continue;
      const Eigen::Vector3d direction = rays_->at(x, y).cast<double>().homogeneous();
      const Eigen::Vector3d point = camera_.projector_from_camera * (direction * map.depth_mm[pixel]);
      const Eigen::Vector2d lit_by = projector_.project(point);
      const int u = static_cast<int>(std::lround(lit_by.x())), v = static_cast<int>(std::lround(lit_by.y()));
      if (u < 0 || v < 0 || u >= width || v >= height) continue;
      label_[pixel] = v * width + u, distance_[pixel] = static_cast<float>(point.z());
    }
  });
  for (std::size_t pixel = 0; pixel < label_.size(); ++pixel) {
    if (label_[pixel] < 0) continue;
    float& nearest = nearest_[label_[pixel]];
    nearest = std::min(nearest, distance_[pixel]);
  }
  for (std::size_t pixel = 0; pixel < label_.size(); ++pixel) {
    if (label_[pixel] >= 0 && distance_[pixel] > kBehind * nearest_[label_[pixel]])
      map.drop(pixel, DensePixel::kOccluded);
  }
}

namespace {

/// Rows of bits, each as wide as the image.
struct BitRows {
  std::size_t words;
  int height;

  /// Ors, or ands, each bit with those up to reach before and behind it in its row.
  template <class Combine>
  void along(std::uint64_t* rows, int reach, std::uint64_t beyond, Combine combine) const {
    for (int y = 0; y < height; ++y) {
      std::uint64_t* row = rows + words * static_cast<std::size_t>(y);
      for (int step = 0; step < reach; ++step) {
        std::uint64_t before = beyond;
        for (std::size_t w = 0; w < words; ++w) {
          const std::uint64_t here = row[w], behind = w + 1 < words ? row[w + 1] : beyond;
          row[w] = combine(here, combine(here << 1 | before >> 63, here >> 1 | behind << 63));
          before = here;
        }
      }
    }
  }
  template <class Combine>
  void across(const std::uint64_t* from, std::uint64_t* to, int reach, Combine combine) const {
    for (int y = 0; y < height; ++y) {
      std::uint64_t* row = to + words * static_cast<std::size_t>(y);
      std::copy_n(from + words * static_cast<std::size_t>(y), words, row);
      for (int k = std::max(0, y - reach); k <= std::min(height - 1, y + reach); ++k) {
        const std::uint64_t* other = from + words * static_cast<std::size_t>(k);
        for (std::size_t w = 0; w < words; ++w) row[w] = combine(row[w], other[w]);
      }
    }
  }
};

}  // namespace

void MapCleaner::drop_unlit_rims(DenseMap& map, int reach_px) {
  const BitRows rows{static_cast<std::size_t>(map.width + 63) / 64, map.height};
  bits_.assign(rows.words * static_cast<std::size_t>(map.height), 0);
  rows_.resize(bits_.size());
  for (int y = 0; y < map.height; ++y) {
    const std::uint8_t* firm = map.firm.data() + static_cast<std::size_t>(y) * map.width;
    std::uint64_t* row = bits_.data() + rows.words * static_cast<std::size_t>(y);
    for (int x = 0; x < map.width; ++x) row[x / 64] |= static_cast<std::uint64_t>(firm[x]) << (x % 64);
  }
  const auto either = [](std::uint64_t a, std::uint64_t b) { return a | b; };
  const auto both = [](std::uint64_t a, std::uint64_t b) { return a & b; };
  rows.along(bits_.data(), reach_px, 0, either);
  rows.across(bits_.data(), rows_.data(), reach_px, either);
  rows.along(rows_.data(), reach_px, ~std::uint64_t{0}, both);
  rows.across(rows_.data(), bits_.data(), reach_px, both);
  for (int y = 0; y < map.height; ++y) {
    const std::uint64_t* row = bits_.data() + rows.words * static_cast<std::size_t>(y);
    for (int x = 0; x < map.width; ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * map.width + x;
      if (map.measured(pixel) && (row[x / 64] >> (x % 64) & 1) == 0) map.drop(pixel, DensePixel::kUnlit);
    }
  }
}

void MapCleaner::drop_islands(DenseMap& map, std::size_t least) {
  const auto count = static_cast<std::int32_t>(map.depth_mm.size());
  label_.assign(map.depth_mm.size(), -1);
  for (std::int32_t first = 0; first < count; ++first) {
    if (label_[first] >= 0 || !map.measured(first)) continue;
    members_.assign(1, first);
    label_[first] = first;
    for (std::size_t next = 0; next < members_.size(); ++next) {
      const std::int32_t pixel = members_[next];
      const int x = pixel % map.width;
      const auto take = [&](std::int32_t other) {
        if (label_[other] >= 0 || is_jump(map.depth_mm[pixel], map.depth_mm[other])) return;
        label_[other] = first;
        members_.push_back(other);
      };
      if (x > 0) take(pixel - 1);
      if (x + 1 < map.width) take(pixel + 1);
      if (pixel >= map.width) take(pixel - map.width);
      if (pixel + map.width < count) take(pixel + map.width);
    }
    if (members_.size() >= least) continue;
    for (const std::int32_t pixel : members_) map.drop(pixel, DensePixel::kIsland);
  }
}

void MapCleaner::prune(DenseMap& map, double reach_px) {
  if (!(reach_px > 0)) return;
  const int width = map.width, height = map.height, reach = static_cast<int>(std::ceil(reach_px)) - 1;
  label_.assign(map.depth_mm.size(), 0);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * width + x;
      const auto differs = [&](std::size_t other) { return is_jump(map.depth_mm[pixel], map.depth_mm[other]); };
      const bool edge = (x > 0 && differs(pixel - 1)) || (x + 1 < width && differs(pixel + 1)) ||
                        (y > 0 && differs(pixel - width)) || (y + 1 < height && differs(pixel + width));
      if (!edge) continue;
      for (int j = std::max(-reach, -y); j <= std::min(reach, height - 1 - y); ++j) {
        for (int i = std::max(-reach, -x); i <= std::min(reach, width - 1 - x); ++i) {
          if (i * i + j * j < reach_px * reach_px) label_[pixel + static_cast<std::ptrdiff_t>(j) * width + i] = 1;
        }
      }
    }
  }
  for (std::size_t pixel = 0; pixel < label_.size(); ++pixel) {
    if (label_[pixel] != 0 && map.measured(pixel)) map.drop(pixel, DensePixel::kAtAnEdge);
  }
}

}  // namespace slsd
