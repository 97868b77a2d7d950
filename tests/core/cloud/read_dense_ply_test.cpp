// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/cloud/read_dense_ply.hpp"

#include <gmock/gmock.h>

#include "core/cloud/dense_file.hpp"

namespace slsd {
namespace {

using testing::HasSubstr;

std::string record(float x, float y, float z, float sigma_mm, char intensity, char camera) {
  std::string bytes;
  for (const float value : {x, y, z, sigma_mm}) bytes.append(reinterpret_cast<const char*>(&value), 4);
  return bytes + intensity + camera;
}

std::string cloud(std::size_t points) {
  std::string bytes = dense_ply_header({"id", "2026-01-01T00:00:00Z", 1, 2, false}, points);
  for (std::size_t i = 0; i < points; ++i) bytes += record(1, 2, 600 + static_cast<float>(i), 0.25F, 'i', '\1');
  return bytes;
}

TEST(ReadDensePly, ReadsWhatTheServiceWrites) {
  const auto points = read_dense_ply(cloud(3));
  ASSERT_TRUE(points.has_value());
  ASSERT_EQ(points->size(), 3);
  EXPECT_EQ((*points)[2].place_mm, Eigen::Vector3f(1, 2, 602));
  EXPECT_EQ((*points)[2].sigma_mm, 0.25F);
  EXPECT_EQ((*points)[2].intensity, 'i');
  EXPECT_EQ((*points)[2].camera, 1);
}

TEST(ReadDensePly, SkipsNormals) {
  std::string bytes = dense_ply_header({"id", "", 1, 1, true}, 2);
  for (int i = 0; i < 2; ++i) bytes += record(1, 2, 600, 0.25F, 'i', '\0') + std::string(12, '\1');
  ASSERT_TRUE(read_dense_ply(bytes).has_value());
  EXPECT_EQ((*read_dense_ply(bytes))[1].place_mm.z(), 600);
}

TEST(ReadDensePly, RefusesPointsInTheRobotsBase) {
  std::string bytes = dense_ply_header({"id", "", 1, 1, false, RigidTransform()}, 1) + record(1, 2, 600, 1, 'i', '\0');
  EXPECT_THAT(read_dense_ply(bytes).error().message, HasSubstr("--coordinate-frame rig"));
}

TEST(ReadDensePly, RefusesWhatIsCutOrAnotherFile) {
  std::string cut = cloud(3);
  cut.pop_back();
  EXPECT_THAT(read_dense_ply(cut).error().message, HasSubstr("is cut: it has 2 of 3 points"));
  EXPECT_EQ(read_dense_ply("").error().code, ErrorCode::kMalformed);
  EXPECT_EQ(read_dense_ply("ply\nformat ascii 1.0\nend_header\n").error().code, ErrorCode::kMalformed);
  EXPECT_THAT(
      read_dense_ply("ply\nformat binary_little_endian 1.0\nelement vertex 0\nproperty uchar symbol\nend_header\n")
          .error()
          .message,
      HasSubstr("with --density pixels"));
  std::string nameless = dense_ply_header({"id", "", 1, 1, false}, 1) + record(1, 2, 600, 0, 'i', '\0');
  EXPECT_THAT(read_dense_ply(nameless).error().message, HasSubstr("no sigma"));
}

}  // namespace
}  // namespace slsd
