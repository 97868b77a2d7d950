// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/cloud/reconstruct.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "drivers/camera/frame_pool.hpp"
#include "tests/core/decode/images.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

constexpr int kRoomLight = 20;

std::vector<Frame> frame_of(const GreyView& image) {
  FramePool pool(format_of(image), 1);
  std::vector<Frame> frames;
  frames.push_back(std::move(*pool.lend(image, 1, std::chrono::steady_clock::now())));
  return frames;
}

/// The cloud of a plane in a lit room, with the room's light told by a frame under a black projector.
std::vector<CloudPoint> scan(const Pattern& pattern, const std::string& format, const GreyView& lit,
                             const GreyView& dark) {
  ScanSetup setup{pattern, draw_pattern(pattern), paper_rig(), {"camera"}, {}};
  setup.camera_formats = {format};
  setup.lanes.emplace_back().push_back(std::move(*Decoder::create(pattern, paper_rig(), 0, {})));
  FrameSet set;
  set.frames = frame_of(lit);
  set.dark = frame_of(dark);
  const auto result = reconstruct(set, setup, 0, {}, "scan");
  EXPECT_TRUE(result);
  return result->cloud.points;
}

// A dark frame alone would be taken for one of fewer bits than the pattern's.
TEST(Reconstruct, TakesTheRoomsLightFromIntensitiesAtEveryDepth) {
  const Pattern pattern = *make_pattern({});
  const Grey8 lit = simulate(draw_pattern(pattern), paper_rig(), plane({0, 0, 2000}, {0, 0, 1}), {.dark = kRoomLight});
  const Grey8 dark(lit.width(), lit.height(), kRoomLight);
  const std::vector<CloudPoint> eight = scan(pattern, "Mono8", lit.view(), dark.view());
  ASSERT_GT(eight.size(), 1000U);
  for (const int bits : {10, 12, 14, 16}) {
    const double full = (1 << bits) - 1;
    for (const std::string& format : {"Mono" + std::to_string(bits), std::string()}) {
      const auto wide = scan(pattern, format, deep(lit, full).view(), deep(dark, full).view());
      ASSERT_NEAR(static_cast<double>(wide.size()), static_cast<double>(eight.size()), 3) << bits << format;
      std::vector<int> before, after;
      for (const CloudPoint& point : eight) before.push_back(point.intensity);
      for (const CloudPoint& point : wide) after.push_back(point.intensity);
      std::ranges::sort(before), std::ranges::sort(after);
      EXPECT_NEAR(after[after.size() / 2], before[before.size() / 2], 1) << bits << format;
    }
  }
}

Result<ScanResult> scan_colours(Result<ColourFrame> colours) {
  const Pattern pattern = *make_pattern({});
  const Grey8 seen = simulate(draw_pattern(pattern), paper_rig(), plane({0, 0, 2000}, {0, 0, 1}), {});
  const Grey8 white(seen.width(), seen.height(), 100);
  ScanSetup setup{pattern, draw_pattern(pattern), paper_rig(), {"camera"}, {}};
  setup.colour_gains = {{1, 1, 2}};
  setup.lanes.emplace_back().push_back(std::move(*Decoder::create(pattern, paper_rig(), 0, {})));
  FrameSet set;
  set.frames = frame_of(seen.view());
  set.white.push_back(std::move(frame_of(white.view()).front()).with_colours([&] { return colours; }));
  ScanRequest request;
  request.texture = request.colour = true;
  return reconstruct(set, setup, 0, request, "scan");
}

TEST(Reconstruct, GivesPointsTheColoursOfTheWhiteFrame) {
  const auto result = scan_colours(ColourFrame(1600, 1200, {10, 20, 30}));
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_TRUE(result->cloud.coloured);
  ASSERT_GT(result->cloud.points.size(), 1000U);
  for (const CloudPoint& point : result->cloud.points) ASSERT_EQ(point.colour, (Rgb{10, 20, 60}));
  ASSERT_EQ(result->white_balance.size(), 1U);
  EXPECT_EQ(result->white_balance.front().gains, (ColourGains{2, 1, 20.0 / 30}));
}

TEST(Reconstruct, LeavesSaturatedPointsOutOfTheWhiteBalance) {
  ColourFrame half(1600, 1200, {10, 20, 40});
  for (int y = 0; y < 1200; ++y)
    for (int x = 800; x < 1600; ++x) half.at(x, y) = {200, 255, 255};
  const auto result = scan_colours(half);
  ASSERT_TRUE(result) << to_string(result.error());
  ASSERT_EQ(result->white_balance.size(), 1U);
  EXPECT_EQ(result->white_balance.front().gains, (ColourGains{2, 1, 0.5}));
  EXPECT_GT(result->saturated, result->cloud.points.size() / 4);
  const auto all = scan_colours(ColourFrame(1600, 1200, {200, 255, 255}));
  ASSERT_TRUE(all) << to_string(all.error());
  EXPECT_THAT(all->white_balance, ::testing::IsEmpty());
}

constexpr ColourLevels kRed{200, 20, 20}, kGreen{20, 200, 20};

/// A plate before a wall.
bool on_plate(const Ray& ray, double& distance) {
  distance = (1700 - ray.origin.z()) / ray.direction.z();
  const Eigen::Vector3d place = ray.origin + distance * ray.direction;
  return distance > 0 && std::abs(place.x()) < 120 && std::abs(place.y()) < 90;
}
std::optional<double> meet(const Ray& ray) {
  double distance = 0;
  if (on_plate(ray, distance)) return distance;
  return plane({0, 0, 2000}, {0, 0, 1})(ray);
}

/// The paper's rig, and a texture camera 500 mm to the left that looks at the same place.
Calibration rig_with_texture() {
  Calibration rig = paper_rig();
  const Eigen::Vector3d centre(-500, 0, 0), forward = (Eigen::Vector3d(0, 0, 1900) - centre).normalized();
  const Eigen::Vector3d right = Eigen::Vector3d::UnitY().cross(forward).normalized();
  CalibratedCamera texture;
  texture.name = "texture";
  texture.lens = {1280, 960, 2400, 2400, 639.5, 479.5, {}};
  texture.rig_from_camera.rotation << right, forward.cross(right), forward;
  texture.rig_from_camera.translation = centre;
  texture.projector_from_camera = rig.cameras[0].projector_from_camera.after(texture.rig_from_camera);
  rig.cameras.push_back(texture);
  return rig;
}

ColourFrame plate_and_wall(const CalibratedCamera& camera) {
  ColourFrame colours(camera.lens.width_px, camera.lens.height_px);
  for (int y = 0; y < colours.height(); ++y) {
    for (int x = 0; x < colours.width(); ++x) {
      const Eigen::Vector3d ray = camera.rig_from_camera.rotation * camera.lens.undistort({x, y}).homogeneous();
      double distance = 0;
      colours.at(x, y) = on_plate({camera.rig_from_camera.translation, ray}, distance) ? kRed : kGreen;
    }
  }
  return colours;
}

/// @param colours  of the texture camera; none: it sees grey alone
Result<ScanResult> scan_plate(const Result<ColourFrame>& colours, ScanRequest request) {
  const Pattern pattern = *make_pattern({});
  const Calibration rig = rig_with_texture();
  const Grey8 seen = simulate(draw_pattern(pattern), rig, meet, {});
  const Grey8 white(seen.width(), seen.height(), 100), of_texture(1280, 960, 100);
  ScanSetup setup{pattern, draw_pattern(pattern), rig, {"camera", "texture"}, {}};
  setup.texture_cameras = 1;
  setup.colour_gains = {{1, 1, 1}, {1, 1, 2}};
  setup.lanes.emplace_back().push_back(std::move(*Decoder::create(pattern, rig, 0, {})));
  FrameSet set;
  set.frames = frame_of(seen.view());
  set.white.push_back(std::move(frame_of(white.view()).front()).with_colours([] {
    return Result<ColourFrame>(ColourFrame(1600, 1200, {1, 2, 3}));
  }));
  set.white.push_back(std::move(frame_of(of_texture.view()).front()).with_colours([&] { return colours; }));
  request.texture = request.colour = true;
  return reconstruct(set, setup, 0, request, "scan");
}

struct PaintedPlate {
  std::size_t red = 0, green = 0, white = 0, wrong = 0;
  /// @param u, v  the point's place in the measuring camera's frame, which shows its true colour
  void count(double u, double v, const Rgb& colour) {
    const auto shows_plate = [&](double right, double down) {
      double ignored = 0;
      const Eigen::Vector3d ray = paper_rig().cameras[0].lens.undistort({u + right, v + down}).homogeneous();
      return on_plate({Eigen::Vector3d::Zero(), ray}, ignored);
    };
    const bool plate = shows_plate(0, 0);
    bool edge = false;  // there a pixel mixes both colours
    for (const double right : {-2, 2})
      for (const double down : {-2, 2}) edge = edge || shows_plate(right, down) != plate;
    if (colour == Rgb{255, 255, 255}) {
      ++white;
    } else if ((colour[0] > colour[1]) == plate) {
      ++(plate ? red : green);
    } else if (!edge) {
      ++wrong;
    }
  }
};

TEST(Reconstruct, PaintsSymbolsByATextureCameraButNotThoseThatItDoesNotSee) {
  const auto result = scan_plate(plate_and_wall(rig_with_texture().cameras[1]), {});
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_TRUE(result->cloud.coloured);
  PaintedPlate painted;
  for (const CloudPoint& point : result->cloud.points) {
    painted.count(point.camera_u, point.camera_v, point.colour);
    EXPECT_EQ(point.intensity, 100);  // the measuring camera's own
    EXPECT_EQ(point.camera, 0);
  }
  EXPECT_EQ(painted.wrong, 0U);
  EXPECT_GT(painted.red, 200U);
  EXPECT_GT(painted.green, 600U);
  EXPECT_GT(painted.white, 20U);
  EXPECT_LT(painted.white, result->cloud.points.size() / 4);
  EXPECT_EQ(result->unseen, painted.white);
  EXPECT_EQ(result->saturated, 0U);
  ASSERT_EQ(result->white_balance.size(), 1U);
  EXPECT_EQ(result->white_balance.front().name, "texture");
  EXPECT_GT(result->white_balance.front().gains[2], 2);  // the scene has little blue, before the gain as well
}

TEST(Reconstruct, PaintsPixelsByATextureCameraInABox) {
  ScanRequest request;
  request.formats = CloudFormats::only({CloudFormat::kPly, Density::kPixels});
  CloudOptions behind;
  behind.box = {-400, -300, 1950, 400, 300, 2050};
  for (const bool in_box : {false, true}) {
    if (in_box) request.part = behind;
    const auto result = scan_plate(plate_and_wall(rig_with_texture().cameras[1]), request);
    ASSERT_TRUE(result) << to_string(result.error());
    ASSERT_TRUE(result->dense && result->dense->coloured());
    const DenseView& view = result->dense->views.front();
    PaintedPlate painted;
    for (std::size_t pixel = 0; pixel < view.colours.size(); ++pixel)
      if (view.map.measured(pixel))
        painted.count(static_cast<double>(pixel % 1600), static_cast<double>(pixel / 1600), view.colours[pixel]);
    EXPECT_EQ(painted.wrong, 0U);
    EXPECT_EQ(painted.red > 10'000, !in_box);
    EXPECT_GT(painted.green, 100'000U);
    EXPECT_GT(painted.white, 1000U);
    EXPECT_LT(painted.white, result->dense->points() / 4);
    EXPECT_EQ(result->dense_unseen, painted.white);
  }
}

TEST(Reconstruct, CountsPointsThatAreSaturatedInTheTextureCamera) {
  const auto result = scan_plate(ColourFrame(1280, 960, {100, 255, 100}), {});
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_EQ(*result->saturated + *result->unseen, result->cloud.points.size());
  EXPECT_GT(*result->saturated, 600U);
  EXPECT_THAT(result->white_balance, ::testing::IsEmpty());
}

TEST(Reconstruct, RefusesATextureCameraWithoutColoursOrOfAnotherSize) {
  const auto grey = scan_plate(ColourFrame(), {});
  ASSERT_FALSE(grey);
  EXPECT_EQ(grey.error().code, ErrorCode::kUnsupported);
  EXPECT_EQ(grey.error().where, "camera texture");
  const auto other = scan_plate(ColourFrame(640, 480), {});
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::kMismatch);
}

// A file may change between its frame and its colours.
TEST(Reconstruct, RefusesColoursThatDoNotFitTheFrame) {
  for (const auto& [colours, code] :
       {std::pair<Result<ColourFrame>, ErrorCode>(ColourFrame(800, 1200), ErrorCode::kMismatch),
        {fail(ErrorCode::kNotFound, "is gone"), ErrorCode::kNotFound},
        {ColourFrame(), ErrorCode::kUnsupported}}) {
    const auto result = scan_colours(colours);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, code) << to_string(result.error());
  }
}

}  // namespace
}  // namespace slsd
