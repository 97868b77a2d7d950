// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/recorded_clouds.hpp"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "bumpy_ball.hpp"
#include "core/calibration_file/calibration_file.hpp"

namespace slsd::model {
namespace {

using testing::HasSubstr;

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
