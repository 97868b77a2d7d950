// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/cloud/texture_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/colour.hpp"

namespace slsd {
namespace {

/// Greatest slope that a surface has, as seen from a camera: a steeper one is a step in depth, or cannot be told from
/// it.
constexpr float kSteepest = 3;
constexpr float kSigmas = 4, kShareOfSpacing = 0.25F;

/// A grid whose gaps are closed as near as a surface in them may be.
class ClosedGrid {
 public:
  explicit ClosedGrid(const MeasuredSurface& surface)
      : apex_(surface.seen_from_mm), points_(surface.points_mm), filled_(points_.size(), 0) {
    close_rows(surface);
    const std::vector<Eigen::Vector3f> by_rows = std::exchange(points_, surface.points_mm);
    close_columns(surface);
    for (std::size_t node = 0; node < points_.size(); ++node) {
      const float nearest = known(node) ? distance(node) : std::numeric_limits<float>::infinity();
      if ((by_rows[node] - apex_).norm() < nearest) points_[node] = by_rows[node];
    }
    close_rows(surface);  // between places that had no neighbours in their row
  }
  [[nodiscard]] const Eigen::Vector3f& at(std::size_t node) const { return points_[node]; }
  [[nodiscard]] bool known(std::size_t node) const { return !std::isnan(points_[node].z()); }
  [[nodiscard]] bool filled(std::size_t node) const { return filled_[node] != 0; }
  /// Tells whether there is a step in depth between two points.
  [[nodiscard]] bool has_step(std::size_t a, std::size_t b) const {
    const float along = distance(a) - distance(b);
    const float across = std::max(0.0F, (points_[a] - points_[b]).squaredNorm() - along * along);
    return along * along > kSteepest * kSteepest * across;
  }
  [[nodiscard]] float distance(std::size_t node) const { return (points_[node] - apex_).norm(); }
  /// The place at another distance on the ray through a point.
  [[nodiscard]] Eigen::Vector3f moved(std::size_t node, float distance_mm) const {
    return apex_ + (points_[node] - apex_).normalized() * distance_mm;
  }

 private:
  void close_rows(const MeasuredSurface& surface) {
    for (int y = 0; y < surface.height; ++y) close(surface.index(0, y), 1, surface.width);
  }
  void close_columns(const MeasuredSurface& surface) {
    for (int x = 0; x < surface.width; ++x)
      close(surface.index(x, 0), static_cast<std::size_t>(surface.width), surface.height);
  }
  // Across a step the whole gap may be as near as the nearer end; else the surface goes on straight.
  void close(std::size_t first, std::size_t step, int count) {
    int last = -1;
    for (int i = 0; i < count; ++i) {
      const std::size_t to = first + static_cast<std::size_t>(i) * step;
      if (!known(to)) continue;
      const std::size_t from = first + static_cast<std::size_t>(std::max(last, 0)) * step;
      const bool step_in_depth = last >= 0 && i > last + 1 && has_step(from, to);
      for (int k = last + 1; last >= 0 && k < i; ++k) {
        const std::size_t node = first + static_cast<std::size_t>(k) * step;
        const float share = static_cast<float>(k - last) / static_cast<float>(i - last);
        points_[node] = (1 - share) * points_[from] + share * points_[to];
        if (step_in_depth) points_[node] = moved(node, std::min(distance(from), distance(to)));
        filled_[node] = 1;
      }
      last = i;
    }
  }

  Eigen::Vector3f apex_;
  std::vector<Eigen::Vector3f> points_;
  std::vector<std::uint8_t> filled_;
};

}  // namespace

MeasuredSurface surface_of(std::span<const CloudPoint> points, const Eigen::Vector3d& projector_mm,
                           const Lens& projector, double cell_px) {
  MeasuredSurface grid;
  for (const CloudPoint& point : points) {
    grid.width = std::max(grid.width, point.column + 1);
    grid.height = std::max(grid.height, point.row + 1);
  }
  grid.points_mm.assign(grid.index(0, grid.height), Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  for (const CloudPoint& point : points)
    grid.points_mm[grid.index(point.column, point.row)] = {point.x, point.y, point.z};
  grid.seen_from_mm = projector_mm.cast<float>();
  grid.pitch = static_cast<float>(cell_px / projector.fx);
  return grid;
}

TextureView::TextureView(const CalibratedCamera& camera, const SceneLight& light)
    : lens_(camera.lens), light_(light), measured_(lens_.width_px, lens_.height_px, 0) {
  const RigidTransform camera_from_rig = camera.rig_from_camera.inverse();
  rotation_ = camera_from_rig.rotation.cast<float>();
  translation_ = camera_from_rig.translation.cast<float>();
  for (const double u : {0.0, lens_.width_px - 1.0})
    for (const double v : {0.0, lens_.height_px - 1.0})
      reach_ = std::max(reach_, lens_.undistort({u, v}).squaredNorm());
}

// Far outside the image the lens model may fold back into it; there, places go on straight from the axis.
TextureView::Place TextureView::project(const Eigen::Vector3f& point_mm) const {
  const Eigen::Vector3d place = (rotation_ * point_mm + translation_).cast<double>();
  if (!(place.z() > 0)) return {};
  const Eigen::Vector2d direction = place.head<2>() / place.z();
  const double beyond = std::sqrt(std::max(1.0, direction.squaredNorm() / reach_));
  const Eigen::Vector2d middle(lens_.cx, lens_.cy);
  const Eigen::Vector2d pixel = middle + beyond * (lens_.distort(direction / beyond) - middle);
  return {pixel.x(), pixel.y(), 1 / place.z(), beyond <= 1};
}

// Halves long triangles, because the lens bends their edges, and those that reach behind the camera.
void TextureView::draw(const Corner& a, const Corner& b, const Corner& c, Nearness& to, int halved) const {
  constexpr double kLongestPx = 16;
  constexpr int kHalvedMost = 24, kHalvedToCamera = 10;
  const auto [least_u, most_u] = std::minmax({a.place.u, b.place.u, c.place.u});
  const auto [least_v, most_v] = std::minmax({a.place.v, b.place.v, c.place.v});
  const auto [least, most] = std::minmax({a.place.nearness, b.place.nearness, c.place.nearness});
  const bool whole = least > 0;
  const bool outside = most_u < 0 || most_v < 0 || least_u > to.width() - 1 || least_v > to.height() - 1;
  if (most <= 0 || (whole && outside)) return;
  if (whole && most_u - least_u <= kLongestPx && most_v - least_v <= kLongestPx)
    return fill({a.place, b.place, c.place}, to);
  if (halved == (whole ? kHalvedMost : kHalvedToCamera)) return;
  const auto length = [&](const Corner& from, const Corner& end) {
    return whole ? std::hypot(end.place.u - from.place.u, end.place.v - from.place.v)
                 : static_cast<double>((end.point_mm - from.point_mm).norm());
  };
  const double ab = length(a, b), bc = length(b, c), ca = length(c, a);
  const auto halve = [&](const Corner& from, const Corner& end, const Corner& apex) {
    const Eigen::Vector3f point = 0.5F * (from.point_mm + end.point_mm);
    const Corner middle{point, project(point)};
    draw(from, middle, apex, to, halved + 1);
    draw(middle, end, apex, to, halved + 1);
  };
  if (ab >= bc && ab >= ca)
    halve(a, b, c);
  else if (bc >= ca)
    halve(b, c, a);
  else
    halve(c, a, b);
}

// Between the corners, the inverse of the depth is linear in the image.
void TextureView::fill(const std::array<Place, 3>& corners, Nearness& to) {
  const auto& [a, b, c] = corners;
  const double area = (b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u);
  if (area == 0) return;
  const int left = std::max(0, static_cast<int>(std::ceil(std::min({a.u, b.u, c.u}))));
  const int right = std::min(to.width() - 1, static_cast<int>(std::floor(std::max({a.u, b.u, c.u}))));
  const int top = std::max(0, static_cast<int>(std::ceil(std::min({a.v, b.v, c.v}))));
  const int bottom = std::min(to.height() - 1, static_cast<int>(std::floor(std::max({a.v, b.v, c.v}))));
  for (int y = top; y <= bottom; ++y) {
    for (int x = left; x <= right; ++x) {
      const double of_b = ((x - a.u) * (c.v - a.v) - (y - a.v) * (c.u - a.u)) / area;
      const double of_c = ((b.u - a.u) * (y - a.v) - (b.v - a.v) * (x - a.u)) / area;
      const double of_a = 1 - of_b - of_c;
      constexpr double kEdge = -1e-9;  // pixels on an edge belong to both triangles
      if (of_a < kEdge || of_b < kEdge || of_c < kEdge) continue;
      const auto nearness = static_cast<float>(of_a * a.nearness + of_b * b.nearness + of_c * c.nearness);
      to.at(x, y) = std::max(to.at(x, y), nearness);
    }
  }
}

void TextureView::add(const MeasuredSurface& surface) {
  surfaces_.push_back({Nearness(lens_.width_px, lens_.height_px, 0), surface.seen_from_mm, surface.pitch});
  Nearness& gaps = surfaces_.back().gaps;
  const ClosedGrid grid(surface);
  std::vector<Place> places(surface.points_mm.size());
  for (std::size_t node = 0; node < places.size(); ++node)
    if (grid.known(node)) places[node] = project(grid.at(node));
  const auto corner = [&](std::size_t node) { return Corner{grid.at(node), places[node]}; };
  const auto join = [&](const std::array<std::size_t, 3>& corners) {
    const auto [a, b, c] = corners;
    if (!grid.known(a) || !grid.known(b) || !grid.known(c)) return;
    const bool step = grid.has_step(a, b) || grid.has_step(b, c) || grid.has_step(a, c);
    const bool gap = step || grid.filled(a) || grid.filled(b) || grid.filled(c);
    draw(corner(a), corner(b), corner(c), gap ? gaps : measured_);
    if (!step) return;
    // The nearer surface ends somewhere between the rays.
    const float nearest = std::min({grid.distance(a), grid.distance(b), grid.distance(c)});
    const auto moved = [&](std::size_t node) {
      const Eigen::Vector3f point = grid.moved(node, nearest);
      return Corner{point, project(point)};
    };
    draw(moved(a), moved(b), moved(c), gaps);
  };
  for (int y = 0; y + 1 < surface.height; ++y) {
    for (int x = 0; x + 1 < surface.width; ++x) {
      const std::size_t a = surface.index(x, y), b = a + 1, c = surface.index(x, y + 1), d = c + 1;
      if (grid.known(b) && grid.known(c))
        join({a, b, c}), join({b, d, c});
      else
        join({a, b, d}), join({a, d, c});
    }
  }
}

bool TextureView::hides(const Nearness& surface, const Place& place, double tolerance) const {
  const int left = static_cast<int>(std::floor(place.u)), top = static_cast<int>(std::floor(place.v));
  // The lens mixes the colours of adjacent pixels: a surface one pixel beside the point hides it, too.
  const double slope = kSteepest * place.nearness / std::min(lens_.fx, lens_.fy);
  for (int y = top - 1; y <= top + 2; ++y) {
    for (int x = left - 1; x <= left + 2; ++x) {
      const double off_px = std::hypot(x - place.u, y - place.v);
      if (surface.at(x, y) > place.nearness + tolerance + slope * off_px) return true;
    }
  }
  const double a = surface.at(left, top), b = surface.at(left + 1, top);
  const double c = surface.at(left, top + 1), d = surface.at(left + 1, top + 1);
  if (std::min({a, b, c, d}) <= 0) return false;
  const double across = place.u - left, above = a + across * (b - a), below = c + across * (d - c);
  return above + (place.v - top) * (below - above) > place.nearness + tolerance;
}

TextureView::Seen TextureView::look(const Eigen::Vector3f& point_mm, float sigma_mm, std::size_t surface,
                                    Rgb& colour) const {
  const Place place = project(point_mm);
  const bool inside =
      place.within && place.u >= 1 && place.v >= 1 && place.u < lens_.width_px - 2 && place.v < lens_.height_px - 2;
  if (!inside) return Seen::kHidden;
  const Surface& own = surfaces_[surface];
  const double spacing_mm = std::max<double>((point_mm - own.seen_from_mm).norm() * own.pitch,
                                             1 / (place.nearness * std::min(lens_.fx, lens_.fy)));
  const double tolerance = (kSigmas * sigma_mm + kShareOfSpacing * spacing_mm) * place.nearness * place.nearness;
  if (hides(measured_, place, tolerance) || hides(own.gaps, place, tolerance)) return Seen::kHidden;
  bool saturated = false;
  const ColourSample dark =
      light_.dark_colours == nullptr ? ColourSample() : sample_colours(*light_.dark_colours, place.u, place.v);
  const Rgb seen = colour_of(sample_colours(*light_.white_colours, place.u, place.v), dark, light_, saturated);
  if (saturated) return Seen::kSaturated;
  colour = seen;
  return Seen::kColour;
}

std::uint8_t paint(const Eigen::Vector3f& point_mm, float sigma_mm, std::span<const TextureView> views,
                   std::size_t surface, Rgb& colour) {
  std::uint8_t painter = kUnseenByAll;
  colour = grey_of(255);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const TextureView::Seen seen = views[i].look(point_mm, sigma_mm, surface, colour);
    if (seen == TextureView::Seen::kColour) return static_cast<std::uint8_t>(i);
    if (seen == TextureView::Seen::kSaturated) painter = kSaturatedInAll;
  }
  return painter;
}

}  // namespace slsd
