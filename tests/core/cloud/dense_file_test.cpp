// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/cloud/dense_file.hpp"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace slsd {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr int kWidth = 3, kHeight = 4;  // two cameras, one below the other
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

template <class Value>
void put(std::string& bytes, Value value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Depths of the pixels in the rig, row by row; a second camera may see what lies behind the first.
constexpr float kDepths[kWidth * kHeight] = {900, kNone, 910, kNone, kNone, 920, 930, kNone, 940, 950, kNone, -960};

/// @param intensity_as_float  as in a PCD
void put_record(std::string& bytes, int pixel, bool normals, bool intensity_as_float) {
  const float depth = kDepths[pixel];
  for (const float value : {depth / 10, -depth / 20, depth, 0.25F}) put(bytes, value);
  const int intensity = std::isnan(depth) ? 0 : 100 + pixel;
  if (intensity_as_float) put(bytes, static_cast<float>(intensity));
  if (!intensity_as_float) put(bytes, static_cast<std::uint8_t>(intensity));
  put(bytes, static_cast<std::uint8_t>(pixel / (kWidth * kHeight / 2)));
  if (normals)
    for (const float value : {0.F, 0.F, -1.F}) put(bytes, value);
}

DenseFacts facts(bool normals) {
  return {"0000002a", "2026-11-28T12:00:00.000Z", 7, 2, normals};
}

std::string pcd(bool normals) {
  std::string bytes = dense_pcd_header(facts(normals), kWidth, kHeight);
  for (int pixel = 0; pixel < kWidth * kHeight; ++pixel) put_record(bytes, pixel, normals, true);
  return bytes;
}

std::string ply(bool normals) {
  std::string bytes = dense_ply_header(facts(normals), 7);
  for (int pixel = 0; pixel < kWidth * kHeight; ++pixel)
    if (!std::isnan(kDepths[pixel])) put_record(bytes, pixel, normals, false);
  return bytes;
}

TEST(DenseFile, NamesItsFieldsAndItsSize) {
  EXPECT_THAT(dense_pcd_header(facts(false), 640, 480),
              AllOf(StartsWith("# .PCD v0.7"), HasSubstr("\nFIELDS x y z sigma_mm intensity camera\n"),
                    HasSubstr("\nWIDTH 640\nHEIGHT 480\n"), EndsWith("POINTS 307200\nDATA binary\n")));
  EXPECT_THAT(dense_ply_header(facts(true), 5),
              AllOf(StartsWith("ply\n"), HasSubstr("\ncomment cameras 2\nelement vertex 5\n"),
                    EndsWith("property float nz\nend_header\n")));
}

TEST(DenseFile, KeepsControlCharactersOutOfItsHeader) {
  DenseFacts odd = facts(false);
  odd.scan_id = "1\nelement vertex 9";
  EXPECT_THAT(dense_ply_header(odd, 5), HasSubstr("comment scan_id 1 element vertex 9\n"));
}

TEST(DenseFile, BecomesThePlyOfTheSamePoints) {
  for (const bool normals : {false, true}) {
    const std::string bytes = pcd(normals);
    const auto pixels = DensePcd::open(bytes, kHeight, normals);
    ASSERT_TRUE(pixels.has_value()) << pixels.error().message;
    DenseFacts known = facts(normals);
    known.cameras = 1;  // the file tells how many there are
    EXPECT_EQ(pixels->to_ply(known), ply(normals));
  }
}

/// The same file with a colour for each pixel: 0, its number, 7.
std::string coloured_pcd(bool normals) {
  DenseFacts coloured = facts(normals);
  coloured.coloured = true;
  std::string bytes = dense_pcd_header(coloured, kWidth, kHeight);
  for (int pixel = 0; pixel < kWidth * kHeight; ++pixel) {
    put_record(bytes, pixel, normals, true);
    put(bytes, static_cast<std::uint32_t>(pixel << 8 | 7));
  }
  return bytes;
}

TEST(DenseFile, KeepsTheColoursOfPixels) {
  for (const bool normals : {false, true}) {
    const std::string bytes = coloured_pcd(normals);
    EXPECT_THAT(bytes,
                HasSubstr(normals ? " normal_z rgb\nSIZE 4 4 4 4 4 1 4 4 4 4\n" : " camera rgb\nSIZE 4 4 4 4 4 1 4\n"));
    const auto pixels = DensePcd::open(bytes, kHeight, normals);
    ASSERT_TRUE(pixels.has_value()) << pixels.error().message;
    const PointGrid grid = pixels->grid();
    ASSERT_EQ(grid.colours.size(), 12u);
    EXPECT_EQ(grid.colours[8], (Rgb{0, 8, 7}));
    EXPECT_EQ(grid.camera[8], 1);
    const std::string as_ply = pixels->to_ply(facts(normals));
    EXPECT_THAT(as_ply, HasSubstr("\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"));
    EXPECT_EQ(as_ply.size() - as_ply.find("end_header\n") - 11, 7 * dense_ply_bytes(normals, true));
    EXPECT_THAT(as_ply, EndsWith(std::string("\0\v\7", 3)));
  }
  const std::string plain = pcd(false);
  EXPECT_TRUE(DensePcd::open(plain, kHeight, false)->grid().colours.empty());
}

TEST(DenseFile, HasAGridOfAllPixels) {
  for (const bool normals : {false, true}) {
    const std::string bytes = pcd(normals);
    const PointGrid grid = DensePcd::open(bytes, kHeight, normals)->grid();
    EXPECT_EQ(grid.width, kWidth);
    EXPECT_EQ(grid.height, kHeight);
    ASSERT_EQ(grid.points_mm.size(), 12u);
    EXPECT_EQ(grid.points_mm[grid.index(2, 2)], Eigen::Vector3f(94, -47, 940));
    EXPECT_EQ(grid.sigma_mm[8], 0.25F);
    EXPECT_EQ(grid.intensity[8], 108);
    EXPECT_EQ(grid.camera[8], 1);
    EXPECT_TRUE(std::isnan(grid.points_mm[1].z()));
    EXPECT_EQ(grid.intensity[1], 0);
    EXPECT_EQ(grid.points_mm[11].z(), -960);
  }
}

TEST(DenseFile, OfTheRobotsBaseKeepsItsFrameInAPlyAndLeavesItForAGrid) {
  const RigidTransform base_from_rig{(Eigen::Matrix3d() << 0, 0, 1, 1, 0, 0, 0, 1, 0).finished(), {1000, -200, 30}};
  DenseFacts in_base = facts(false);
  in_base.base_from_rig = base_from_rig;
  std::string bytes = dense_pcd_header(in_base, kWidth, kHeight);
  for (int pixel = 0; pixel < kWidth * kHeight; ++pixel) put_record(bytes, pixel, false, true);
  const auto pixels = DensePcd::open(bytes, kHeight, false);
  ASSERT_TRUE(pixels.has_value());
  ASSERT_TRUE(pixels->base_from_rig());
  const std::string as_ply = pixels->to_ply(facts(false));
  EXPECT_THAT(as_ply, HasSubstr("comment base_from_rig 0 0 1 1000 1 0 0 -200 0 1 0 30\n"));
  EXPECT_EQ(as_ply.substr(as_ply.find("end_header")), ply(false).substr(ply(false).find("end_header")));
  // x, y, z of the base are z + 1000, x - 200, y + 30 of the rig.
  EXPECT_LT((pixels->grid().points_mm[8] - Eigen::Vector3f(-47 + 200, 940 - 30, 94 - 1000)).norm(), 1e-3);
  EXPECT_TRUE(std::isnan(pixels->grid().points_mm[1].z()));
}

TEST(DenseFile, HasALatticeOfEverySecondPixel) {
  const std::string bytes = pcd(true);
  const Cloud cloud = DensePcd::open(bytes, kHeight, true)->lattice(2);
  EXPECT_EQ(cloud.lattice_columns, 2);
  EXPECT_EQ(cloud.lattice_rows, 2);
  ASSERT_EQ(cloud.points.size(), 4u);
  const CloudPoint& last = cloud.points.back();
  EXPECT_EQ(last.z, 940);
  EXPECT_EQ(last.x, 94);
  EXPECT_EQ(last.intensity, 108);
  EXPECT_EQ(last.column, 1);
  EXPECT_EQ(last.row, 1);
}

TEST(DenseFile, ThatIsNoneOrTooShortIsRefused) {
  const std::string whole = pcd(false);
  for (const std::string& bytes : {std::string(), std::string("DATA binary\n"), std::string("\nDATA binary\n"),
                                   whole.substr(0, whole.size() - 1), dense_ply_header(facts(false), 0)}) {
    const auto read = DensePcd::open(bytes, kHeight, false);
    ASSERT_FALSE(read.has_value());
    EXPECT_EQ(read.error().code, ErrorCode::kMalformed);
  }
  EXPECT_FALSE(DensePcd::open(whole, kHeight + 1, false).has_value());
  // A single record that is cut, and sizes whose product in bytes is beyond 64 bits.
  EXPECT_FALSE(DensePcd::open(dense_pcd_header(facts(false), 1, 1) + std::string(10, 'x'), 1, false).has_value());
  constexpr int kMost = std::numeric_limits<int>::max();
  EXPECT_FALSE(DensePcd::open(dense_pcd_header(facts(false), kMost, kMost) + whole, kMost, false).has_value());
  EXPECT_FALSE(DensePcd::open(whole, kHeight, true).has_value());
}

}  // namespace
}  // namespace slsd
