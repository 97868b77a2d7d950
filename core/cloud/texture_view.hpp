// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/cloud/cloud.hpp"
#include "core/cloud/shade_points.hpp"
#include "core/geometry/calibration.hpp"
#include "core/image.hpp"

namespace slsd {

/// The surface that one camera measured: points on a grid of its pixels, or of the pattern's cells.
struct MeasuredSurface {
  int width = 0, height = 0;
  std::vector<Eigen::Vector3f> points_mm = {};             ///< row by row, rig frame; NaN: no point
  Eigen::Vector3f seen_from_mm = Eigen::Vector3f::Zero();  ///< where the rays through the grid meet, rig frame
  float pitch = 0;                                         ///< from one of the rays to the next, rad

  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

/// The surface of one camera's symbols, on the grid of the pattern's cells.
/// @param projector  where it is in the rig, and its lens
/// @param cell_px    from one cell to the next in the projector's picture
[[nodiscard]] MeasuredSurface surface_of(std::span<const CloudPoint> points, const Eigen::Vector3d& projector_mm,
                                         const Lens& projector, double cell_px);

/// A camera that serves for colour alone: the colours that it sees, and the surfaces that hide others from it.
///
///     texture camera  *             a is seen. The object hides b, and c may be hidden by a side of the
///                      \ '- ._      object that no camera has measured: between the object's edge and the
///                       \      '-   wall, the surface may reach as near as the edge.
///     object        =====#~~~~~
///                         \    '
///     wall  ---a-----------b----c----
///
/// @thread reentrant, except add()
class TextureView {
 public:
  /// The camera's answer about a point.
  enum class Seen : std::uint8_t { kColour, kSaturated, kHidden };

  /// @param light  of its white frame, with colours; their frames must outlive this
  TextureView(const CalibratedCamera& camera, const SceneLight& light);

  /// Adds the surface of a camera, which hides what lies behind it. The first one gets the number 0.
  void add(const MeasuredSurface& surface);

  /// The colour of a point where this camera sees it: inside the image, neither saturated nor hidden, and on a surface
  /// that it does not see from the side. A point is hidden if a surface is nearer to the camera by more than four
  /// sigmas and a quarter of the distance between points.
  /// @param surface  number of the point's own; its gaps hide the point, those of others do not
  /// @param colour   set if it is seen
  [[nodiscard]] Seen look(const Eigen::Vector3f& point_mm, float sigma_mm, std::size_t surface, Rgb& colour) const;

 private:
  /// A place in the image's plane, and the inverse of its depth; 0 or less behind the camera.
  struct Place {
    double u = 0, v = 0, nearness = 0;
    bool within = false;  ///< as far from the axis as the image's corners, or nearer
  };
  struct Corner {
    Eigen::Vector3f point_mm;
    Place place;
  };
  using Nearness = Image<float>;  // by pixel, 1/mm along the camera's axis; 0: no surface
  struct Surface {
    Nearness gaps;  // as near as its gaps may reach
    Eigen::Vector3f seen_from_mm;
    float pitch;
  };
  [[nodiscard]] Place project(const Eigen::Vector3f& point_mm) const;
  [[nodiscard]] bool hides(const Nearness& surface, const Place& place, double tolerance) const;
  void draw(const Corner& a, const Corner& b, const Corner& c, Nearness& to, int halved = 0) const;
  static void fill(const std::array<Place, 3>& corners, Nearness& to);

  Lens lens_;
  Eigen::Matrix3f rotation_;  // camera from rig
  Eigen::Vector3f translation_;
  double reach_ = 0;  // of the image's farthest corner: squared tangent of its angle from the axis
  SceneLight light_;
  Nearness measured_;  // of all surfaces
  std::vector<Surface> surfaces_;
};

/// A point is painted by the number of a texture view, or by one of these: its colour is then unknown.
inline constexpr std::uint8_t kUnseenByAll = 255, kSaturatedInAll = 254;

/// Gives a point the colour of the first view that sees it; white if none does: then its colour is unknown.
/// @return the number of that view, kSaturatedInAll if those that see it are saturated, or kUnseenByAll
[[nodiscard]] std::uint8_t paint(const Eigen::Vector3f& point_mm, float sigma_mm, std::span<const TextureView> views,
                                 std::size_t surface, Rgb& colour);

}  // namespace slsd
