// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/mesh/mesh_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/mesh/any_mesh.hpp"

namespace slsd {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

// tests/core/mesh/read_meshes.py reads the files by assimp.

TEST(MeshFile, KnowsItsFormats) {
  EXPECT_EQ(mesh_format("ply"), MeshFormat::kPly);
  EXPECT_EQ(mesh_format("stl"), MeshFormat::kStl);
  EXPECT_EQ(mesh_format("obj"), MeshFormat::kObj);
  EXPECT_EQ(mesh_format("glb"), MeshFormat::kGlb);
  EXPECT_EQ(mesh_format("pcd"), std::nullopt);
  EXPECT_EQ(mesh_format(""), std::nullopt);
}

TEST(MeshFile, WritesSigmaAndColourToPlyAsFarAsTheyAreThere) {
  const auto all = write_mesh(tetrahedron(), MeshFormat::kPly, "scan 7");
  ASSERT_TRUE(all.has_value());
  EXPECT_THAT(*all, HasSubstr("\ncomment scan 7\ncomment units mm\nelement vertex 4\n"));
  EXPECT_THAT(*all, HasSubstr("\nproperty float sigma_mm\nproperty uchar red\n"));
  const std::size_t data = all->find("end_header\n") + 11;
  EXPECT_EQ(all->size(), data + 4 * 19 + 4 * 13);
  Mesh fused = tetrahedron();
  fused.frames = {1, 2, 3, 0x104};
  const auto counted = write_mesh(fused, MeshFormat::kPly, "");
  ASSERT_TRUE(counted.has_value());
  EXPECT_THAT(*counted, HasSubstr("\nproperty ushort frames\n"));
  const std::size_t of_last = counted->find("end_header\n") + 11 + 4 * 21;
  EXPECT_EQ(counted->size(), of_last + 4 * 13);
  EXPECT_EQ(counted->substr(of_last - 2, 2), "\x04\x01");  // little-endian
  Mesh bare = tetrahedron();
  bare.sigma_mm.clear(), bare.intensity.clear();
  const auto plain = write_mesh(bare, MeshFormat::kPly, "");
  ASSERT_TRUE(plain.has_value());
  EXPECT_THAT(*plain, AllOf(Not(HasSubstr("sigma")), Not(HasSubstr("red"))));
  EXPECT_EQ(plain->size(), plain->find("end_header\n") + 11 + 4 * 12 + 4 * 13);
}

TEST(MeshFile, KeepsItsTitleFromBreakingTheFile) {
  const std::string odd = "a\"b\\c\nelement vertex 9\xff";
  EXPECT_THAT(*write_mesh(tetrahedron(), MeshFormat::kPly, odd), HasSubstr("comment a\"b\\c element vertex 9"));
  EXPECT_THAT(*write_mesh(tetrahedron(), MeshFormat::kObj, odd), StartsWith("# a\"b\\c element vertex 9"));
  EXPECT_THAT(*write_mesh(tetrahedron(), MeshFormat::kGlb, odd), HasSubstr(R"("name":"abc element vertex 9")"));
  const auto stl = write_mesh(tetrahedron(), MeshFormat::kStl, std::string(200, 'x'));
  EXPECT_THAT(*stl, Not(StartsWith("solid")));
  EXPECT_EQ(stl->size(), 84u + 4 * 50);
}

TEST(MeshFile, WritesGlbWithoutColour) {
  Mesh bare = tetrahedron();
  bare.intensity.clear();
  const auto glb = write_mesh(bare, MeshFormat::kGlb, "");
  ASSERT_TRUE(glb.has_value());
  EXPECT_THAT(*glb, AllOf(Not(HasSubstr("COLOR_0")), HasSubstr(R"("byteLength":144})")));
  EXPECT_EQ(glb->size() % 4, 0u);
}

TEST(MeshFile, RefusesAMeshWithoutTriangles) {
  Mesh points = tetrahedron();
  points.triangles.clear();
  const auto refused = write_mesh(points, MeshFormat::kStl, "");
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::kNotFound);
}

TEST(MeshFile, RefusesWhatAFormatCannotHold) {
  constexpr std::uint64_t kFourBillion = 1ULL << 32;
  EXPECT_TRUE(check_mesh_size(MeshFormat::kGlb, 70'000'000, 190'000'000).has_value());
  EXPECT_THAT(check_mesh_size(MeshFormat::kGlb, 70'000'000, 200'000'000).error().message, HasSubstr("GLB"));
  EXPECT_TRUE(check_mesh_size(MeshFormat::kStl, 3, kFourBillion - 1).has_value());
  EXPECT_THAT(check_mesh_size(MeshFormat::kStl, 3, kFourBillion).error().message, HasSubstr("STL"));
  EXPECT_TRUE(check_mesh_size(MeshFormat::kPly, kFourBillion / 2 - 1, 3).has_value());
  EXPECT_FALSE(check_mesh_size(MeshFormat::kPly, kFourBillion / 2, 3).has_value());
  EXPECT_FALSE(check_mesh_size(MeshFormat::kObj, kFourBillion, 3).has_value());
}

}  // namespace
}  // namespace slsd
