// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/mesh/mesh_grid.hpp"

#include <cmath>
#include <limits>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

namespace slsd {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr float kJump = 0.004F, kDepthMm = 1000, kPitchMm = 0.5F;

/// A wall before the camera. In each row of the drawing '.' is a pixel of the wall, ' ' one that was not measured, and
/// a digit one that is so many tenths of the allowed jump nearer.
PointGrid drawn(const std::vector<std::string_view>& rows) {
  PointGrid grid;
  grid.width = static_cast<int>(rows.front().size()), grid.height = static_cast<int>(rows.size());
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      const char pixel = rows[y][x];
      const float nearer = pixel == '.' ? 0 : kJump * kDepthMm * static_cast<float>(pixel - '0') / 10;
      const float depth = pixel == ' ' ? kNone : kDepthMm - nearer;
      const Eigen::Vector3f place(kPitchMm * static_cast<float>(x), kPitchMm * static_cast<float>(y), depth);
      grid.points_mm.push_back(pixel == ' ' ? Eigen::Vector3f::Constant(kNone) : place);
      grid.sigma_mm.push_back(pixel == ' ' ? kNone : 0.1F);
      grid.intensity.push_back(static_cast<std::uint8_t>(10 * y + x));
      grid.camera.push_back(0);
    }
  }
  return grid;
}

std::size_t triangles(const std::vector<std::string_view>& rows) {
  return mesh_grid(drawn(rows), kJump).triangles.size();
}

TEST(MeshGrid, JoinsFourPixelsByTwoTriangles) {
  const Mesh mesh = mesh_grid(drawn({"..", ".."}), kJump);
  EXPECT_THAT(mesh.triangles, ElementsAre(std::array{0U, 2U, 1U}, std::array{1U, 2U, 3U}));
  EXPECT_THAT(mesh.intensity, ElementsAre(0, 1, 10, 11));
  EXPECT_THAT(mesh.sigma_mm, ElementsAre(0.1F, 0.1F, 0.1F, 0.1F));
}

TEST(MeshGrid, TurnsTrianglesTowardsTheCamera) {
  for (const auto& rows : {std::vector<std::string_view>{"..", ".."},
                           {" .", ".."},
                           {". ", ".."},
                           {"..", " ."},
                           {"..", ". "},
                           {"5.", ".5"},
                           {".5", "5."}}) {
    const Mesh mesh = mesh_grid(drawn(rows), kJump);
    ASSERT_THAT(mesh.triangles, testing::Not(IsEmpty()));
    for (const auto& [a, b, c] : mesh.triangles) {
      const Eigen::Vector3f& corner = mesh.vertices_mm[a];
      EXPECT_LT((mesh.vertices_mm[b] - corner).cross(mesh.vertices_mm[c] - corner).z(), 0);
    }
  }
}

TEST(MeshGrid, LeavesHolesOpen) {
  EXPECT_EQ(triangles({"...", "...", "..."}), 8u);
  EXPECT_EQ(triangles({"...", ". .", "..."}), 4u);  // of each corner
  EXPECT_EQ(triangles({". .", " . ", ". ."}), 0u);
}

TEST(MeshGrid, TakesThreeOfFourPixels) {
  for (const auto& rows : {std::vector<std::string_view>{" .", ".."}, {". ", ".."}, {"..", " ."}, {"..", ". "}})
    EXPECT_EQ(triangles(rows), 1u) << rows[0] << "/" << rows[1];
}

TEST(MeshGrid, IsOpenAtAnEdgeInDepth) {
  EXPECT_EQ(triangles({"..99", "..99"}), 6u);  // 0.9 of the jump is a slope
  PointGrid grid = drawn({"..99", "..99"});
  for (const int right : {2, 3, 6, 7}) grid.points_mm[right].z() -= 0.2F * kJump * kDepthMm;
  EXPECT_THAT(mesh_grid(grid, kJump).triangles, SizeIs(4));
}

TEST(MeshGrid, MeasuresTheJumpByTheDistance) {
  PointGrid grid = drawn({"..", "99"});
  EXPECT_THAT(mesh_grid(grid, kJump).triangles, SizeIs(2));
  for (Eigen::Vector3f& point : grid.points_mm) point.z() -= kDepthMm / 4;
  EXPECT_THAT(mesh_grid(grid, kJump).triangles, IsEmpty());
}

TEST(MeshGrid, FindsAnEdgeFromAnyDirection) {
  // A second camera that looks along the rig's x axis: an edge in its depth is no change of z.
  PointGrid grid = drawn({"..99", "..99"});
  for (const int right : {2, 3, 6, 7}) grid.points_mm[right].z() -= 0.2F * kJump * kDepthMm;
  for (Eigen::Vector3f& point : grid.points_mm) point = Eigen::Vector3f(point.z(), point.y(), -point.x());
  EXPECT_THAT(mesh_grid(grid, kJump).triangles, SizeIs(4));
}

TEST(MeshGrid, LeavesOutPointsThatCannotTellAnEdge) {
  PointGrid grid = drawn({"...", "...", "..."});
  const float third = kJump * grid.points_mm[4].norm() / 3;
  grid.sigma_mm[4] = 0.99F * third;
  EXPECT_THAT(mesh_grid(grid, kJump).triangles, SizeIs(8));
  grid.sigma_mm[4] = 1.01F * third;
  const Mesh mesh = mesh_grid(grid, kJump);
  EXPECT_THAT(mesh.triangles, SizeIs(4));
  EXPECT_THAT(mesh.vertices_mm, SizeIs(8));
}

TEST(MeshGrid, TakesTheShorterDiagonal) {
  EXPECT_THAT(mesh_grid(drawn({".5", ".."}), kJump).triangles,
              ElementsAre(std::array{0U, 2U, 3U}, std::array{0U, 3U, 1U}));
  EXPECT_THAT(mesh_grid(drawn({"5.", ".."}), kJump).triangles,
              ElementsAre(std::array{0U, 2U, 1U}, std::array{1U, 2U, 3U}));
}

TEST(MeshGrid, TakesTheDiagonalOfMoreTriangles) {
  // a and b are joined, and both to c, but not to d: only the diagonal from b to c gives a triangle.
  PointGrid grid = drawn({"..", ".."});
  grid.points_mm[3].z() -= 1.2F * kJump * kDepthMm;
  EXPECT_THAT(mesh_grid(grid, kJump).triangles, ElementsAre(std::array{0U, 2U, 1U}));
}

TEST(MeshGrid, DoesNotJoinCameras) {
  PointGrid grid = drawn({"..", "..", "..", ".."});
  for (std::size_t pixel = 4; pixel < 8; ++pixel) grid.camera[pixel] = 1;
  EXPECT_THAT(mesh_grid(grid, kJump).triangles, SizeIs(4));
}

TEST(MeshGrid, KeepsNoVertexWithoutATriangle) {
  const Mesh mesh = mesh_grid(drawn({".. .", "..  ", "    "}), kJump);
  EXPECT_THAT(mesh.intensity, ElementsAre(0, 1, 10, 11));
  EXPECT_THAT(mesh_grid(PointGrid{}, kJump).vertices_mm, IsEmpty());
}

}  // namespace
}  // namespace slsd
