// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/cloud/texture_view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "core/colour.hpp"

namespace slsd {
namespace {

using Eigen::Vector3d;
using Seen = TextureView::Seen;

constexpr ColourLevels kWall{20, 200, 20}, kFront{200, 20, 20}, kSide{20, 20, 200}, kNothing{0, 0, 0};
constexpr float kNoPoint = std::numeric_limits<float>::quiet_NaN();

/// The first surface that a ray meets.
struct Hit {
  double distance = std::numeric_limits<double>::infinity();
  ColourLevels colour = kNothing;
};

/// A wall, and a box before it whose front and sides have other colours.
struct Scene {
  double wall_mm = 1000;
  Eigen::AlignedBox3d box{Vector3d(-60, -60, 700), Vector3d(60, 60, 800)};

  [[nodiscard]] Hit meet(const Vector3d& from, const Vector3d& direction) const {
    Hit hit;
    if (direction.z() > 0) hit = {(wall_mm - from.z()) / direction.z(), kWall};
    double enter = -std::numeric_limits<double>::infinity(), leave = -enter;
    int by = 0;
    for (int axis = 0; axis < 3; ++axis) {
      double a = (box.min()[axis] - from[axis]) / direction[axis], b = (box.max()[axis] - from[axis]) / direction[axis];
      if (a > b) std::swap(a, b);
      if (a > enter) enter = a, by = axis;
      leave = std::min(leave, b);
    }
    if (enter > 0 && enter < leave && enter < hit.distance)
      hit = {enter, by == 2 && direction.z() > 0 ? kFront : kSide};
    return hit;
  }
};

CalibratedCamera camera_at(const Vector3d& centre, const Vector3d& target, int width = 640, int height = 480,
                           double focal_px = 600) {
  CalibratedCamera camera;
  camera.lens = {width, height, focal_px, focal_px, 0.5 * (width - 1), 0.5 * (height - 1), {-0.05, 0.01, 0, 0, 0}};
  const Vector3d forward = (target - centre).normalized(), right = Vector3d::UnitY().cross(forward).normalized();
  Eigen::Matrix3d& axes = camera.rig_from_camera.rotation;
  axes.col(0) = right, axes.col(1) = forward.cross(right), axes.col(2) = forward;
  camera.rig_from_camera.translation = centre;
  return camera;
}

Vector3d ray_of(const CalibratedCamera& camera, double u, double v) {
  return camera.rig_from_camera.rotation * camera.lens.undistort({u, v}).homogeneous();
}

ColourFrame picture_of(const Scene& scene, const CalibratedCamera& camera) {
  ColourFrame picture(camera.lens.width_px, camera.lens.height_px);
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x)
      picture.at(x, y) = scene.meet(camera.rig_from_camera.translation, ray_of(camera, x, y)).colour;
  return picture;
}

/// Points that a camera beside a projector measures: on a grid that both see, with noise along its rays.
struct Measured {
  MeasuredSurface grid;
  std::vector<ColourLevels> colours;
};

Measured measure(const Scene& scene, const CalibratedCamera& camera, const Vector3d& projector, int step,
                 float sigma_mm = 0) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 1);
  Measured measured;
  MeasuredSurface& grid = measured.grid;
  grid.width = camera.lens.width_px / step, grid.height = camera.lens.height_px / step;
  grid.points_mm.assign(grid.index(0, grid.height), Eigen::Vector3f::Constant(kNoPoint));
  measured.colours.resize(grid.points_mm.size());
  const Vector3d& centre = camera.rig_from_camera.translation;
  grid.seen_from_mm = centre.cast<float>();
  grid.pitch = static_cast<float>(step / camera.lens.fx);
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      const Vector3d ray = ray_of(camera, x * step, y * step).normalized();
      const Hit hit = scene.meet(centre, ray);
      const Vector3d point = centre + hit.distance * ray;
      const Hit lit = scene.meet(projector, point - projector);
      if (hit.colour == kNothing || std::abs(lit.distance - 1) > 1e-6) continue;
      grid.points_mm[grid.index(x, y)] = (point + sigma_mm * noise(random) * ray).cast<float>();
      measured.colours[grid.index(x, y)] = hit.colour;
    }
  }
  return measured;
}

Rgb rgb_of(const ColourLevels& levels) {
  return {static_cast<std::uint8_t>(levels[0]), static_cast<std::uint8_t>(levels[1]),
          static_cast<std::uint8_t>(levels[2])};
}

struct Painted {
  int wrong = 0;    ///< of another surface's colour
  int hidden = 0;   ///< of the points that the camera does not see, those without a colour
  int missing = 0;  ///< of those that it sees, those without a colour
  int seen = 0, unseen = 0;

  [[nodiscard]] double missing_share() const { return static_cast<double>(missing) / seen; }
};

Painted paint_all(const Scene& scene, const Measured& measured, const CalibratedCamera& texture, float sigma_mm = 0) {
  const ColourFrame picture = picture_of(scene, texture);
  TextureView view(texture, {.white_colours = &picture});
  view.add(measured.grid);
  Painted painted;
  const Vector3d& centre = texture.rig_from_camera.translation;
  for (std::size_t i = 0; i < measured.colours.size(); ++i) {
    const Eigen::Vector3f& point = measured.grid.points_mm[i];
    if (std::isnan(point.z())) continue;
    const Vector3d in_texture = texture.rig_from_camera.inverse() * point.cast<double>();
    const Eigen::Vector2d pixel = texture.lens.project(in_texture);
    const bool inside = in_texture.z() > 0 && pixel.x() > 1 && pixel.y() > 1 && pixel.x() < texture.lens.width_px - 2 &&
                        pixel.y() < texture.lens.height_px - 2;
    const Vector3d ray = point.cast<double>() - centre;
    const bool sees = inside && std::abs(scene.meet(centre, ray).distance - 1) * ray.norm() < 1 + 8 * sigma_mm;
    Rgb colour{};
    const Seen seen = view.look(point, sigma_mm, 0, colour);
    (sees ? painted.seen : painted.unseen) += 1;
    if (seen == Seen::kHidden) (sees ? painted.missing : painted.hidden) += 1;
    // At the border of two colours, a pixel mixes them.
    if (seen == Seen::kColour)
      for (std::size_t k = 0; k < 3; ++k)
        if (std::abs(colour[k] - rgb_of(measured.colours[i])[k]) > 90) {
          ++painted.wrong;
          break;
        }
  }
  return painted;
}

const CalibratedCamera kCamera = camera_at({0, 0, 0}, {0, 0, 1000});
const Vector3d kProjector(150, 0, 0);

TEST(TextureView, PaintsNoPointInTheColourOfWhatHidesIt) {
  const Scene scene;
  for (const auto& [step, sigma_mm] : {std::pair(1, 0.3F), {2, 0.0F}, {6, 0.0F}, {6, 0.3F}, {12, 0.3F}}) {
    const Measured measured = measure(scene, kCamera, kProjector, step, sigma_mm);
    for (const Vector3d& place : {Vector3d(-300, 0, 0), Vector3d(-80, 0, 0), Vector3d(80, 20, 0), Vector3d(400, 0, 200),
                                  Vector3d(0, 350, 0), Vector3d(0, -350, 100)}) {
      const Painted painted = paint_all(scene, measured, camera_at(place, {0, 0, 900}), sigma_mm);
      SCOPED_TRACE(::testing::Message() << place.transpose() << " step " << step << " sigma " << sigma_mm);
      EXPECT_EQ(painted.wrong, 0);
      EXPECT_EQ(painted.hidden, painted.unseen);
      EXPECT_GT(painted.seen, painted.unseen);
      EXPECT_LT(painted.missing_share(), step < 3 ? 0.08 : 0.2);
    }
  }
}

// A box that stands off the wall: behind it the wall is hidden by its unmeasured back and side, not by its front.
TEST(TextureView, TakesWhatNoCameraMeasuredBehindAnEdgeAsSolid) {
  Scene scene;
  scene.box = {Vector3d(-40, -60, 500), Vector3d(40, 60, 800)};
  const Measured measured = measure(scene, kCamera, kProjector, 2);
  const Painted painted = paint_all(scene, measured, camera_at({700, 0, 500}, {0, 0, 1000}));
  EXPECT_GT(painted.unseen, 500);
  EXPECT_EQ(painted.wrong, 0);
  EXPECT_EQ(painted.hidden, painted.unseen);
}

// The lowest row of a plate was not measured: its row alone goes on at the wall, its column on the plate.
TEST(TextureView, ClosesAGapAsNearAsItsRowOrItsColumnMayReach) {
  const Scene scene;
  for (const bool turned : {false, true}) {
    Measured measured = measure(scene, kCamera, Vector3d::Zero(), 4);
    MeasuredSurface& grid = measured.grid;
    for (int y = 0; y < grid.height; ++y)
      for (int x = 0; x < grid.width; ++x) {
        Eigen::Vector3f& point = grid.points_mm[grid.index(x, y)];
        if (point.z() < 750 && (turned ? point.x() : point.y()) > 45) point.setConstant(kNoPoint);
      }
    const Vector3d from = turned ? Vector3d(-350, 0, 0) : Vector3d(0, -350, 0);
    const Painted painted = paint_all(scene, measured, camera_at(from, {0, 0, 900}));
    EXPECT_GT(painted.unseen, 100);
    EXPECT_EQ(painted.wrong, 0) << turned;
    EXPECT_EQ(painted.hidden, painted.unseen) << turned;
  }
}

TEST(TextureView, SeesAllOfASmoothSurface) {
  Scene scene;
  scene.box = {Vector3d(5000, 0, 0), Vector3d(5001, 1, 1)};
  for (const int step : {1, 4, 12}) {
    const Measured measured = measure(scene, kCamera, kProjector, step, 0.2F);
    const Painted painted = paint_all(scene, measured, camera_at({200, 50, 0}, {0, 0, 1000}, 1280, 960, 900), 0.2F);
    EXPECT_EQ(painted.wrong, 0);
    EXPECT_LT(painted.missing_share(), 0.002) << step;
  }
}

TEST(TextureView, LeavesPointsOutsideItsImageAlone) {
  const ColourFrame picture(640, 480, {50, 60, 70});
  TextureView view(camera_at({0, 0, 0}, {0, 0, 1000}), {.white_colours = &picture});
  view.add(
      {2, 2, std::vector<Eigen::Vector3f>(4, Eigen::Vector3f::Constant(kNoPoint)), Eigen::Vector3f::Zero(), 0.001F});
  Rgb colour{};
  EXPECT_EQ(view.look({0, 0, 1000}, 0.1F, 0, colour), Seen::kColour);
  EXPECT_EQ(colour, (Rgb{50, 60, 70}));
  colour = {};
  for (const Eigen::Vector3f& beyond :
       {Eigen::Vector3f(0, 0, -1000), Eigen::Vector3f(600, 0, 1000), Eigen::Vector3f(0, -450, 1000),
        Eigen::Vector3f(0, 0, 0), Eigen::Vector3f(40000, 0, 1000), Eigen::Vector3f(0, 0, kNoPoint)})
    EXPECT_EQ(view.look(beyond, 0.1F, 0, colour), Seen::kHidden) << beyond.transpose();
  EXPECT_EQ(colour, Rgb{});
}

// Strong barrel distortion folds points far outside back into the image.
TEST(TextureView, DoesNotFollowALensThatFoldsBack) {
  CalibratedCamera camera = camera_at({0, 0, 0}, {0, 0, 1000}, 640, 480, 500);
  camera.lens.distortion = {-0.3, 0, 0, 0, 0};
  const ColourFrame picture(640, 480, {50, 60, 70});
  TextureView view(camera, {.white_colours = &picture});
  view.add(
      {2, 2, std::vector<Eigen::Vector3f>(4, Eigen::Vector3f::Constant(kNoPoint)), Eigen::Vector3f::Zero(), 0.001F});
  const Eigen::Vector3f folded(1750, 0, 1000);
  const Eigen::Vector2d pixel = camera.lens.project(folded.cast<double>());
  ASSERT_TRUE(pixel.x() > 1 && pixel.x() < 638);
  Rgb colour{};
  EXPECT_EQ(view.look(folded, 0.1F, 0, colour), Seen::kHidden);
}

TEST(TextureView, TellsSaturatedColoursAndSubtractsTheRoom) {
  ColourFrame picture(640, 480, {50, 60, 70});
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 320; ++x) picture.at(x, y) = {100, 255, 100};
  const ColourFrame room(640, 480, {10, 0, 20});
  TextureView view(camera_at({0, 0, 0}, {0, 0, 1000}),
                   {.white_colours = &picture, .dark_colours = &room, .gains = {2, 1, 1}});
  view.add(
      {2, 2, std::vector<Eigen::Vector3f>(4, Eigen::Vector3f::Constant(kNoPoint)), Eigen::Vector3f::Zero(), 0.001F});
  Rgb colour{};
  EXPECT_EQ(view.look({100, 0, 1000}, 0.1F, 0, colour), Seen::kColour);
  EXPECT_EQ(colour, (Rgb{80, 60, 50}));
  EXPECT_EQ(view.look({-100, 0, 1000}, 0.1F, 0, colour), Seen::kSaturated);
}

TEST(TextureView, TellsPointsOnASurfaceFromThoseBehindItByTheirSigma) {
  const ColourFrame picture(640, 480, {50, 60, 70});
  Scene scene;
  scene.box = {Vector3d(5000, 0, 0), Vector3d(5001, 1, 1)};
  const Measured measured = measure(scene, kCamera, kProjector, 2);  // 3.3 mm from point to point
  TextureView view(camera_at({100, 0, 0}, {0, 0, 1000}), {.white_colours = &picture});
  view.add(measured.grid);
  Rgb colour{};
  EXPECT_EQ(view.look({0, 0, 1000.5F}, 0, 0, colour), Seen::kColour);
  EXPECT_EQ(view.look({0, 0, 1002}, 0, 0, colour), Seen::kHidden);
  EXPECT_EQ(view.look({0, 0, 1002}, 0.5F, 0, colour), Seen::kColour);
  EXPECT_EQ(view.look({0, 0, 1004}, 0.5F, 0, colour), Seen::kHidden);
  EXPECT_EQ(view.look({0, 0, 990}, 0, 0, colour), Seen::kColour);
}

// One camera's gap is no evidence against a point that another has measured there.
TEST(TextureView, HidesAPointByTheGapsOfItsOwnSurfaceAlone) {
  const ColourFrame picture(640, 480, {50, 60, 70});
  Scene scene;
  scene.box = {Vector3d(5000, 0, 0), Vector3d(5001, 1, 1)};
  Measured holed = measure(scene, kCamera, kProjector, 2);
  MeasuredSurface& grid = holed.grid;
  for (int y = 0; y < grid.height; ++y)
    for (int x = 150; x < 170; ++x) grid.points_mm[grid.index(x, y)].setConstant(kNoPoint);
  const Eigen::Vector3f behind(0, 0, 1300);
  const MeasuredSurface nothing{2, 2, std::vector<Eigen::Vector3f>(4, Eigen::Vector3f::Constant(kNoPoint)),
                                Eigen::Vector3f::Zero(), 0.001F};
  TextureView view(camera_at({100, 0, 0}, {0, 0, 1300}), {.white_colours = &picture});
  view.add(grid);
  view.add(nothing);
  Rgb colour{};
  EXPECT_EQ(view.look(behind, 0, 0, colour), Seen::kHidden);
  EXPECT_EQ(view.look(behind, 0, 1, colour), Seen::kColour);
}

TEST(Paint, TakesTheFirstViewThatSeesThePoint) {
  const ColourFrame red(640, 480, {200, 0, 0}), green(640, 480, {0, 200, 0}), bright(640, 480, {255, 255, 255});
  const MeasuredSurface nothing{2, 2, std::vector<Eigen::Vector3f>(4, Eigen::Vector3f::Constant(kNoPoint)),
                                Eigen::Vector3f::Zero(), 0.001F};
  const auto view_of = [&](const ColourFrame& picture, const Vector3d& target) {
    TextureView view(camera_at({0, 0, 0}, target), {.white_colours = &picture});
    view.add(nothing);
    return view;
  };
  const Vector3d here(0, 0, 1000), elsewhere(2000, 0, 500);
  const auto painted = [&](const std::vector<TextureView>& views) {
    Rgb colour{1, 2, 3};
    const std::uint8_t painter = paint({0, 0, 1000}, 0.1F, views, 0, colour);
    return std::pair(painter, colour);
  };
  EXPECT_EQ(painted({view_of(red, here), view_of(green, here)}), std::pair(std::uint8_t{0}, Rgb{200, 0, 0}));
  EXPECT_EQ(painted({view_of(red, elsewhere), view_of(green, here)}), std::pair(std::uint8_t{1}, Rgb{0, 200, 0}));
  EXPECT_EQ(painted({view_of(bright, here), view_of(green, here)}), std::pair(std::uint8_t{1}, Rgb{0, 200, 0}));
  EXPECT_EQ(painted({view_of(bright, here), view_of(red, elsewhere)}), std::pair(kSaturatedInAll, grey_of(255)));
  EXPECT_EQ(painted({view_of(red, elsewhere)}), std::pair(kUnseenByAll, grey_of(255)));
}

TEST(SurfaceOf, PutsSymbolsOnTheGridOfTheirCells) {
  CloudPoint a, b;
  a.column = 2, a.row = 1, a.x = 10, a.y = 20, a.z = 900;
  b.column = 0, b.row = 3, b.z = 800;
  Lens projector;
  projector.fx = 1800;
  const MeasuredSurface grid = surface_of(std::vector{a, b}, {100, 0, 5}, projector, 18);
  EXPECT_EQ(std::pair(grid.width, grid.height), std::pair(3, 4));
  EXPECT_EQ(grid.points_mm[grid.index(2, 1)], Eigen::Vector3f(10, 20, 900));
  EXPECT_EQ(grid.points_mm[grid.index(0, 3)].z(), 800);
  EXPECT_TRUE(std::isnan(grid.points_mm[grid.index(1, 1)].z()));
  EXPECT_EQ(grid.seen_from_mm, Eigen::Vector3f(100, 0, 5));
  EXPECT_FLOAT_EQ(grid.pitch, 0.01F);
  EXPECT_TRUE(surface_of({}, {0, 0, 0}, projector, 18).points_mm.empty());
}

}  // namespace
}  // namespace slsd
