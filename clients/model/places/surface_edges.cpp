// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/places/surface_edges.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Eigenvalues>

#include "core/dense/dense_map.hpp"

namespace slsd::model {
namespace {

/// The camera and the projector must reach so many pixels beyond an edge.
constexpr int kBeyondPx = 4;
/// A surface within so many pixels beyond an edge may hide or shade what is beyond, or be the same surface.
constexpr int kShadePx = 32;
/// Pixels along which an edge's direction is fitted, to either side.
constexpr float kAlongPx = 8;
/// Variances along and across a straight edge, px^2.
constexpr float kLeastAlong = 4, kMostAcross = 1;
constexpr float kFewestPixels = 4;
/// The dense match needs so many of the projector's pixels around a place.
constexpr double kDarkBorderPx = 8;
/// Standard deviation of an edge's place, in pixels.
constexpr float kEdgeSigmaPx = 2;
/// A dense cloud ends so many pixels before the edge, as a match needs its neighbourhood: the median of rendered
/// clouds.
constexpr float kErodedPx = 3;
/// Cosine between the normals of the ending surface and of the one so many pixels before it, from which on it is flat.
/// A round one ends elsewhere in each view.
constexpr float kFlat = 0.98F, kBeforePx = 13;
/// Cosine between the direction across an edge and the ray back, above which the face behind a right-angled edge is in
/// view: the measurement goes on there, and ends at no fixed place.
constexpr float kTowards = 0.15F;
/// Cosine between normal and ray below which a surface may bend away instead of ending.
constexpr float kFacing = 0.5F;

struct Border {
  Eigen::Vector2f pixel, outwards;
};

class EdgeFinder {
 public:
  EdgeFinder(const RangeImage& image, const CellGrid& grid)
      : image_(image), grid_(grid), borders_(grid.cells.size()), rig_from_camera_(image.camera_from_rig.inverse()) {
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) add_border(x, y);
  }

  [[nodiscard]] EdgeGrid find() const {
    EdgeGrid found{{}, std::vector<std::int32_t>(grid_.cells.size(), EdgeGrid::kNone)};
    for (std::size_t cell = 0; cell < borders_.size(); ++cell) {
      if (borders_[cell].empty()) continue;
      if (const auto edge = edge_of(cell)) {
        found.of_cell[cell] = static_cast<std::int32_t>(found.edges.size());
        found.edges.push_back(*edge);
      }
    }
    return found;
  }

 private:
  [[nodiscard]] std::size_t cell_at(int x, int y) const {
    return static_cast<std::size_t>(y / grid_.step) * static_cast<std::size_t>(grid_.width) +
           static_cast<std::size_t>(x / grid_.step);
  }
  [[nodiscard]] float depth(int x, int y) const {
    if (x < 0 || y < 0 || x >= image_.width || y >= image_.height) return std::numeric_limits<float>::quiet_NaN();
    return image_.depth_mm[image_.index(x, y)];
  }
  void add_border(int x, int y) {
    const float here = depth(x, y);
    if (std::isnan(here)) return;
    constexpr std::array<std::array<int, 2>, 4> kWays{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
    Eigen::Vector2f outwards = Eigen::Vector2f::Zero();
    for (const auto& [dx, dy] : kWays)
      if (ends_towards(x, y, dx, dy, here)) outwards += Eigen::Vector2f(dx, dy);
    if (outwards.squaredNorm() > 0)
      borders_[cell_at(x, y)].push_back({Eigen::Vector2f(x, y) + 0.5F * outwards, outwards});
  }
  /// Tells whether whatever is measured next in a direction lies farther than the surface could reach.
  [[nodiscard]] bool ends_towards(int x, int y, int dx, int dy, float here) const {
    const float jump = kDepthJump * here;
    const float steepest = std::sqrt(1 / (kFacing * kFacing) - 1) * here / static_cast<float>(image_.lens.fx);
    for (int i = 1; i <= kShadePx; ++i) {
      const int u = x + i * dx, v = y + i * dy;
      if (i <= kBeyondPx && !image_sees(u, v)) return false;
      const float beyond = depth(u, v);
      if (!std::isnan(beyond)) return beyond > here + jump + steepest * static_cast<float>(i);
    }
    return true;
  }
  [[nodiscard]] bool image_sees(int x, int y) const {
    return x + image_.left >= 0 && y + image_.top >= 0 && x + image_.left < image_.lens.width_px &&
           y + image_.top < image_.lens.height_px;
  }
  /// Tells whether a place of the rig's frame was lit and is in the box.
  [[nodiscard]] bool can_be_measured(const Eigen::Vector3f& place) const {
    if (image_.box && !image_.box->contains(place)) return false;
    const Eigen::Vector3d in_projector = image_.projector_from_rig * place.cast<double>();
    if (!(in_projector.z() > 0)) return false;
    const Eigen::Vector2d pixel = image_.projector.project(in_projector);
    return (pixel.array() >= kDarkBorderPx).all() && pixel.x() < image_.projector.width_px - kDarkBorderPx &&
           pixel.y() < image_.projector.height_px - kDarkBorderPx;
  }
  /// The measured cell nearest to one that may have too few pixels itself.
  [[nodiscard]] std::optional<std::size_t> surface_at(std::size_t cell) const {
    const int column = static_cast<int>(cell % static_cast<std::size_t>(grid_.width)),
              row = static_cast<int>(cell / static_cast<std::size_t>(grid_.width));
    std::optional<std::size_t> found;
    int nearest = 9;
    visit_cells_around(grid_, cell, 1, [&](std::size_t other) {
      const int x = static_cast<int>(other % static_cast<std::size_t>(grid_.width)),
                y = static_cast<int>(other / static_cast<std::size_t>(grid_.width));
      const int off = (x - column) * (x - column) + (y - row) * (y - row);
      if (grid_.cells[other].sigma_mm > 0 && off < nearest) nearest = off, found = other;
    });
    return found;
  }
  [[nodiscard]] std::optional<SurfaceEdge> edge_of(std::size_t cell) const {
    const auto from = surface_at(cell);
    if (!from) return std::nullopt;
    const SurfaceCell& surface = grid_.cells[*from];
    Eigen::Vector2f middle = Eigen::Vector2f::Zero(), outwards = Eigen::Vector2f::Zero();
    for (const Border& border : borders_[cell]) middle += border.pixel, outwards += border.outwards;
    middle /= static_cast<float>(borders_[cell].size());
    Eigen::Vector2f sum = Eigen::Vector2f::Zero();
    Eigen::Matrix2f squares = Eigen::Matrix2f::Zero();
    float count = 0;
    visit_cells_around(grid_, cell, static_cast<int>(kAlongPx) / grid_.step + 1, [&](std::size_t other) {
      for (const Border& border : borders_[other]) {
        const Eigen::Vector2f off = border.pixel - middle;
        if (off.squaredNorm() > kAlongPx * kAlongPx || border.outwards.dot(outwards) <= 0) continue;
        sum += off, squares += off * off.transpose(), ++count;
      }
    });
    if (count < kFewestPixels) return std::nullopt;
    const Eigen::Vector2f mean = sum / count;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2f> lines(squares / count - mean * mean.transpose());
    if (lines.eigenvalues()[0] > kMostAcross || lines.eigenvalues()[1] < kLeastAlong) return std::nullopt;
    const Eigen::Vector2f along = lines.eigenvectors().col(1);
    Eigen::Vector2f beside(-along.y(), along.x());
    if (beside.dot(outwards) < 0) beside = -beside;
    const Eigen::Vector2f inside = middle - kBeforePx * beside;
    const SurfaceCell* const before = grid_.at(inside.x(), inside.y());
    if (!before || before->normal.dot(surface.normal) < kFlat) return std::nullopt;
    // The fitted line's point nearest to the cell's own border.
    const Eigen::Vector2f on = middle + mean - along * along.dot(mean) + kErodedPx * beside;
    const Eigen::Vector3f place = on_surface(surface, on);
    const Eigen::Vector3f step = on_surface(surface, on + beside) - place;  // per pixel
    Eigen::Vector3f across = (on_surface(surface, on + along) - place).cross(surface.normal).normalized();
    if (across.dot(step) < 0) across = -across;
    const Eigen::Vector3f ray = (place - rig_from_camera_.translation.cast<float>()).normalized();
    if (-ray.dot(surface.normal) < kFacing || -ray.dot(across) > kTowards) return std::nullopt;
    if (!can_be_measured(place + kBeyondPx * step)) return std::nullopt;
    return SurfaceEdge{place, surface.normal, across, kEdgeSigmaPx * across.dot(step), *from};
  }
  /// The point of a cell's plane on a pixel's ray.
  [[nodiscard]] Eigen::Vector3f on_surface(const SurfaceCell& surface, const Eigen::Vector2f& pixel) const {
    const Eigen::Vector2d direction =
        image_.lens.undistort(pixel.cast<double>() + Eigen::Vector2d(image_.left, image_.top));
    const Eigen::Vector3d ray = rig_from_camera_.rotation * direction.homogeneous();
    const Eigen::Vector3d eye = rig_from_camera_.translation;
    const Eigen::Vector3d normal = surface.normal.cast<double>();
    const double far = normal.dot(surface.place_mm.cast<double>() - eye) / normal.dot(ray);
    return (eye + far * ray).cast<float>();
  }

  const RangeImage& image_;
  const CellGrid& grid_;
  std::vector<std::vector<Border>> borders_;
  RigidTransform rig_from_camera_;
};

}  // namespace

EdgeGrid surface_edges(const RangeImage& image, const CellGrid& grid) {
  return EdgeFinder(image, grid).find();
}

}  // namespace slsd::model
