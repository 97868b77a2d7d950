// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/cloud/pcd.hpp"

#include <cmath>
#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/cloud/point_record.hpp"
#include "tests/core/cloud/any_cloud.hpp"

namespace slsd {
namespace {

using ::testing::HasSubstr;

// A record as a PLY has it, where intensity is a byte.
CloudPoint cell(const std::string& pcd, std::size_t index) {
  std::string record = pcd.substr(pcd.find("DATA binary\n") + 12 + index * kPcdPointBytes, kPcdPointBytes);
  float intensity = -1;
  std::memcpy(&intensity, record.data() + 12, sizeof intensity);
  record.replace(12, sizeof intensity, 1, static_cast<char>(static_cast<std::uint8_t>(intensity)));
  return read_point(record.data()).value();
}

TEST(WritePcd, PutsEachPointInItsCellAndNanElsewhere) {
  const Cloud cloud = any_cloud(5, 7, 4);
  const std::string pcd = write_pcd(cloud);
  EXPECT_THAT(pcd, HasSubstr("\nWIDTH 7\nHEIGHT 8\n"));
  EXPECT_THAT(pcd, HasSubstr("\nPOINTS 56\n"));
  EXPECT_EQ(pcd.size(), pcd.find("DATA binary\n") + 12 + 56 * kPcdPointBytes);
  std::size_t next = 0;
  for (std::size_t i = 0; i < 56; ++i) {
    const CloudPoint found = cell(pcd, i);
    EXPECT_EQ((found.camera * 4U + found.row) * 7U + found.column, i);
    if (std::isnan(found.x)) {
      EXPECT_TRUE(std::isnan(found.z) && std::isnan(found.camera_u) && std::isnan(found.sigma_mm));
      EXPECT_EQ(found.symbol, 0);
    } else {
      EXPECT_EQ(found, cloud.points[next++]);
    }
  }
  EXPECT_EQ(next, cloud.points.size());
}

TEST(WritePcd, StoresIntensityAsAFloat) {
  EXPECT_THAT(write_pcd(any_cloud(5, 7, 4)), HasSubstr("\nFIELDS x y z intensity camera_u camera_v projector_u "
                                                       "projector_v camera symbol sigma_mm column row\n"
                                                       "SIZE 4 4 4 4 4 4 4 4 1 1 4 4 4\n"
                                                       "TYPE F F F F F F F F U U F I I\n"));
}

TEST(WritePcd, LeavesOutWhatIsOutsideTheLattice) {
  Cloud cloud;
  cloud.lattice_columns = cloud.lattice_rows = 2;
  cloud.points.resize(2);
  cloud.points[0].column = 2;
  cloud.points[1].camera = 1;
  const std::string pcd = write_pcd(cloud);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_TRUE(std::isnan(cell(pcd, i).x));
}

TEST(WritePcd, TakesPointsIntoTheRobotsBase) {
  const RigidTransform base_from_rig{(Eigen::Matrix3d() << 0, 0, 1, 1, 0, 0, 0, 1, 0).finished(), {1000, -200.5, 30}};
  const Cloud cloud = any_cloud(5, 7, 4);
  const std::string pcd = write_pcd(cloud, &base_from_rig);
  EXPECT_THAT(pcd, HasSubstr("\n# base_from_rig 0 0 1 1000 1 0 0 -200.5 0 1 0 30\nVERSION 0.7\n"));
  EXPECT_THAT(pcd, HasSubstr("\nVIEWPOINT 1000 -200.5 30 0.5 0.5 0.5 0.5\n"));
  const CloudPoint& point = cloud.points.front();
  const CloudPoint found = cell(pcd, (point.camera * 4U + point.row) * 7U + point.column);
  EXPECT_FLOAT_EQ(found.x, point.z + 1000);
  EXPECT_FLOAT_EQ(found.y, point.x - 200.5F);
  EXPECT_FLOAT_EQ(found.z, point.y + 30);
}

TEST(WritePcd, IsEmptyWithoutALattice) {
  EXPECT_THAT(write_pcd({}), HasSubstr("WIDTH 0\nHEIGHT 0\n"));
}

}  // namespace
}  // namespace slsd
