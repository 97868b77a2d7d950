// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <gmock/gmock.h>

#include <cstring>
#include <filesystem>
#include <fstream>

#include "bumpy_ball.hpp"
#include "clients/model/read_cloud.hpp"
#include "clients/model/recorded_clouds.hpp"
#include "core/calibration_file/calibration_file.hpp"
#include "core/cloud/dense_file.hpp"

namespace slsd::model {
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

TEST(ReadCloud, ReadsWhatTheServiceWrites) {
  const auto points = read_cloud(cloud(3));
  ASSERT_TRUE(points.has_value());
  ASSERT_EQ(points->size(), 3);
  EXPECT_EQ((*points)[2].place_mm, Eigen::Vector3f(1, 2, 602));
  EXPECT_EQ((*points)[2].sigma_mm, 0.25F);
  EXPECT_EQ((*points)[2].intensity, 'i');
  EXPECT_EQ((*points)[2].camera, 1);
}

TEST(ReadCloud, SkipsNormals) {
  std::string bytes = dense_ply_header({"id", "", 1, 1, true}, 2);
  for (int i = 0; i < 2; ++i) bytes += record(1, 2, 600, 0.25F, 'i', '\0') + std::string(12, '\1');
  ASSERT_TRUE(read_cloud(bytes).has_value());
  EXPECT_EQ((*read_cloud(bytes))[1].place_mm.z(), 600);
}

TEST(ReadCloud, RefusesPointsInTheRobotsBase) {
  std::string bytes = dense_ply_header({"id", "", 1, 1, false, RigidTransform()}, 1) + record(1, 2, 600, 1, 'i', '\0');
  EXPECT_THAT(read_cloud(bytes).error().message, HasSubstr("--coordinate-frame rig"));
}

TEST(ReadCloud, RefusesWhatIsCutOrAnotherFile) {
  std::string cut = cloud(3);
  cut.pop_back();
  EXPECT_THAT(read_cloud(cut).error().message, HasSubstr("is cut: it has 2 of 3 points"));
  EXPECT_EQ(read_cloud("").error().code, ErrorCode::kMalformed);
  EXPECT_EQ(read_cloud("ply\nformat ascii 1.0\nend_header\n").error().code, ErrorCode::kMalformed);
  EXPECT_THAT(read_cloud("ply\nformat binary_little_endian 1.0\nelement vertex 0\nproperty uchar symbol\nend_header\n")
                  .error()
                  .message,
              HasSubstr("density = \"pixels\""));
  std::string nameless = dense_ply_header({"id", "", 1, 1, false}, 1) + record(1, 2, 600, 0, 'i', '\0');
  EXPECT_THAT(read_cloud(nameless).error().message, HasSubstr("no sigma"));
}

TEST(RangeImages, RefusesAnotherCalibration) {
  const auto points = measure(bumpy_ball, rig_from_object(0), 0.01F, 1);
  Calibration other = test_calibration();
  EXPECT_TRUE(range_images(points, other, std::nullopt).has_value());
  other.cameras[0].lens.fx *= 1.01;
  EXPECT_EQ(range_images(points, other, std::nullopt).error().code, ErrorCode::kMismatch);
}

TEST(RangeImages, KeepsWhatIsInTheBox) {
  const auto points = measure(bumpy_ball, rig_from_object(0), 0.01F, 1);
  const Box box(Eigen::Vector3f(-10, -10, 0), Eigen::Vector3f(10, 10, 1000));
  const auto images = range_images(points, test_calibration(), box);
  ASSERT_TRUE(images.has_value());
  EXPECT_NEAR(images->front().width, 20 * 1800 / 548, 4);
}

class Recording : public testing::Test {
 protected:
  Recording() {
    std::filesystem::create_directories(folder_);
    Calibration calibration = test_calibration();
    calibration.projector = calibration.cameras[0].lens;
    calibration.cameras[0].projector_from_camera.translation.x() = 100;
    write("calibration.yml", write_calibration(calibration));
    write("recording.json", R"({"scans":2})");
    write("scans.jsonl", "{\"cloud\":\"clouds/0.ply\"}\n{\"error\":{}}\n{\"cloud\":\"clouds/1.ply\"}\n");
  }
  ~Recording() override { std::filesystem::remove_all(folder_); }
  void write(const char* name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }

  std::filesystem::path folder_ = std::filesystem::temp_directory_path() / ("slsd-test-" + std::to_string(::getpid()));
};

TEST_F(Recording, NamesItsClouds) {
  const auto recorded = read_recording(folder_);
  ASSERT_TRUE(recorded.has_value()) << to_string(recorded.error());
  EXPECT_THAT(recorded->names, testing::ElementsAre("clouds/0.ply", "clouds/1.ply"));
  EXPECT_EQ(recorded->failed, 1);
  EXPECT_THAT(recorded->warnings, testing::IsEmpty());
}

TEST_F(Recording, SaysThatItWasCut) {
  write("recording.json", R"({"scans":0})");
  ASSERT_TRUE(read_recording(folder_).has_value());
  EXPECT_THAT(read_recording(folder_)->warnings, testing::ElementsAre(HasSubstr("the recording was cut")));
  write("recording.json", R"({"scans":1})");
  write("scans.jsonl", "{\"cloud\":\"clouds/0.ply\"}\n{\"cloud\":\"clou");
  const auto recorded = read_recording(folder_);
  ASSERT_TRUE(recorded.has_value());
  EXPECT_THAT(recorded->names, testing::ElementsAre("clouds/0.ply"));
  EXPECT_THAT(recorded->warnings, testing::ElementsAre(HasSubstr("its first 1 clouds are used")));
}

TEST_F(Recording, NeedsClouds) {
  write("scans.jsonl", "{}\n");
  EXPECT_THAT(read_recording(folder_).error().message, HasSubstr("has no clouds"));
  std::filesystem::remove(folder_ / "scans.jsonl");
  EXPECT_THAT(read_recording(folder_).error().message, HasSubstr("is not a recording"));
}

}  // namespace
}  // namespace slsd::model
