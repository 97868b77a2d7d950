// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <gmock/gmock.h>

#include "bumpy_ball.hpp"
#include "clients/model/mesh/tidy_mesh.hpp"
#include "clients/model/mesh/volume.hpp"

namespace slsd::model {
namespace {

constexpr VolumeOptions kOptions{.voxel_mm = 1, .band_mm = 4, .fewest_frames = 2};

/// As the rig sees the object.
float off_mm(const Eigen::Vector3f& vertex) {
  return bumpy_ball(vertex - kMiddle.cast<float>()) / 0.7F;
}

TEST(Volume, MeansFramesByTheirSigmas) {
  Volume volume(kOptions);
  // One frame is off by a millimetre, and says so.
  const auto shifted = [](float by_mm, float sigma_mm) {
    auto points = measure(bumpy_ball, rig_from_object(0), 0.001F, 1);
    for (DensePoint& point : points) point.place_mm.z() += by_mm, point.sigma_mm = sigma_mm;
    std::erase_if(points, [](const DensePoint& point) { return point.place_mm.head<2>().norm() > 15; });
    // Back onto the rays.
    for (DensePoint& point : points) point.place_mm.head<2>() *= point.place_mm.z() / (point.place_mm.z() - by_mm);
    return make_shot(*range_images(points, test_calibration(), std::nullopt));
  };
  volume.add(shifted(0, 0.1F), {});
  volume.add(shifted(1, 0.3F), {});
  const Mesh mesh = volume.mesh();
  ASSERT_GT(mesh.vertices_mm.size(), 500);
  double sum = 0, most = 0;
  for (const Eigen::Vector3f& vertex : mesh.vertices_mm) sum += off_mm(vertex);
  const double mean = sum / static_cast<double>(mesh.vertices_mm.size());
  for (const Eigen::Vector3f& vertex : mesh.vertices_mm) most = std::max(most, std::abs(off_mm(vertex) - mean));
  EXPECT_NEAR(mean, -0.1, 0.03);  // 1 mm farther, of weight 1/0.09 beside 1/0.01
  EXPECT_LT(most, 0.3);
  for (const float sigma : mesh.sigma_mm) EXPECT_NEAR(sigma, 1 / std::sqrt(1 / 0.01 + 1 / 0.09), 0.03);
  for (const std::uint16_t frames : mesh.frames) EXPECT_EQ(frames, 2);
  for (const std::uint8_t intensity : mesh.intensity) EXPECT_EQ(intensity, 100);
}

/// A shot whose colours tell the place on the object: red to the right, blue below.
Shot coloured_shot(unsigned seed, bool coloured) {
  auto points = measure(bumpy_ball, rig_from_object(0), 0.02F, seed);
  for (DensePoint& point : points) {
    const auto level = [](float along_mm) { return static_cast<std::uint8_t>(std::lround(128 + 2 * along_mm)); };
    point.coloured = coloured;
    point.colour = {level(point.place_mm.x()), 90, level(point.place_mm.y())};
  }
  return make_shot(*range_images(points, test_calibration(), std::nullopt));
}

TEST(Volume, KeepsTheColourOfThePlace) {
  Volume volume(kOptions);
  for (unsigned seed : {1U, 2U, 3U}) volume.add(coloured_shot(seed, true), {});
  const Mesh mesh = tidy(volume.mesh(), 0.01);
  ASSERT_GT(mesh.vertices_mm.size(), 2000);
  ASSERT_EQ(mesh.colours.size(), mesh.vertices_mm.size());
  std::size_t far = 0;
  for (std::size_t i = 0; i < mesh.colours.size(); ++i) {
    const Eigen::Vector3f& vertex = mesh.vertices_mm[i];
    const auto off = [](std::uint8_t level, float along_mm) { return std::abs(level - 128 - 2 * along_mm); };
    far += off(mesh.colours[i][0], vertex.x()) > 4 || off(mesh.colours[i][2], vertex.y()) > 4;
    EXPECT_NEAR(mesh.colours[i][1], 90, 1);
  }
  EXPECT_LT(static_cast<double>(far), 0.02 * static_cast<double>(mesh.colours.size()));
}

TEST(Volume, TakesTheIntensityOfCloudsWithoutColour) {
  Volume plain(kOptions), mixed(kOptions);
  for (unsigned seed : {1U, 2U}) plain.add(coloured_shot(seed, false), {});
  EXPECT_TRUE(plain.mesh().colours.empty());
  for (unsigned seed : {1U, 2U}) mixed.add(coloured_shot(seed, false), {});
  mixed.add(coloured_shot(3, true), {});
  const Mesh mesh = mixed.mesh();
  ASSERT_EQ(mesh.colours.size(), mesh.vertices_mm.size());
  double green = 0;
  for (const Rgb& colour : mesh.colours) green += colour[1];
  EXPECT_NEAR(green / static_cast<double>(mesh.colours.size()), (100 + 100 + 90) / 3.0, 2);  // the intensity is 100
}

TEST(Volume, FacesTheCamera) {
  Volume volume(kOptions);
  for (unsigned seed : {1U, 2U}) volume.add(shot_of(bumpy_ball, rig_from_object(0), 0.02F, seed), {});
  const Mesh mesh = volume.mesh();
  std::size_t facing = 0;
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3f& a = mesh.vertices_mm[triangle[0]];
    const Eigen::Vector3f normal = (mesh.vertices_mm[triangle[1]] - a).cross(mesh.vertices_mm[triangle[2]] - a);
    if (normal.dot(a) < 0) ++facing;
  }
  EXPECT_GT(mesh.triangles.size(), 5000);
  EXPECT_GT(static_cast<double>(facing), 0.999 * static_cast<double>(mesh.triangles.size()));
}

TEST(Volume, LeavesOutWhatOneFrameAloneMeasured) {
  Volume volume(kOptions);
  volume.add(shot_of(bumpy_ball, rig_from_object(0), 0.02F, 1), {});
  EXPECT_TRUE(volume.mesh().triangles.empty());
}

TEST(Volume, HasNoSurfaceWhereLightPassed) {
  Volume volume(kOptions);
  const Shot shot = shot_of(bumpy_ball, rig_from_object(0), 0.02F, 1);
  const RigidTransform nearer{Eigen::Matrix3d::Identity(), Eigen::Vector3d(0, 0, -20)};
  for (int i = 0; i < 2; ++i) volume.add(shot, nearer);  // wrongly placed: 20 mm before the object
  for (int i = 0; i < 5; ++i) volume.add(shot, {});
  const Mesh mesh = tidy(volume.mesh(), 0.01);
  ASSERT_GT(mesh.vertices_mm.size(), 2000);
  std::size_t before = 0;
  for (const Eigen::Vector3f& vertex : mesh.vertices_mm)
    if (off_mm(vertex) > 5) ++before;
  EXPECT_LT(static_cast<double>(before), 0.02 * static_cast<double>(mesh.vertices_mm.size()));
}

Mesh mesh_of(std::vector<std::array<std::uint32_t, 3>> triangles, std::size_t vertices) {
  Mesh mesh;
  for (std::size_t i = 0; i < vertices; ++i) {
    mesh.vertices_mm.push_back(Eigen::Vector3f::Constant(static_cast<float>(i)));
    mesh.sigma_mm.push_back(static_cast<float>(i));
  }
  mesh.triangles = std::move(triangles);
  return mesh;
}

TEST(TidyMesh, GivesEachFanItsVertex) {
  // Two pairs of triangles meet in vertex 0 alone.
  const Mesh tidied = tidy(mesh_of({{0, 1, 2}, {0, 2, 3}, {0, 4, 5}, {0, 5, 6}}, 7), 0);
  EXPECT_EQ(tidied.triangles.size(), 4);
  EXPECT_EQ(tidied.vertices_mm.size(), 8);
  EXPECT_EQ(tidied.triangles[0][0], tidied.triangles[1][0]);
  EXPECT_EQ(tidied.triangles[2][0], tidied.triangles[3][0]);
  EXPECT_NE(tidied.triangles[0][0], tidied.triangles[2][0]);
  for (std::size_t i = 0; i < tidied.vertices_mm.size(); ++i) EXPECT_EQ(tidied.sigma_mm[i], tidied.vertices_mm[i].x());
}

TEST(TidyMesh, LeavesOutSmallPiecesAndUnusedVertices) {
  const Mesh tidied = tidy(mesh_of({{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {6, 7, 8}}, 10), 0.5);
  EXPECT_EQ(tidied.triangles.size(), 3);
  EXPECT_EQ(tidied.vertices_mm.size(), 5);
  EXPECT_EQ(tidy(mesh_of({{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {6, 7, 8}}, 10), 0.2).triangles.size(), 4);
}

}  // namespace
}  // namespace slsd::model
