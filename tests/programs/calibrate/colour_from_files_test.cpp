// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "drivers/files/encode_png.hpp"
#include "drivers/files/read_image.hpp"
#include "tests/programs/calibrate/from_files.hpp"

namespace slsd {
namespace {

using std::filesystem::path;
using test::FromFiles, test::configuration_text, test::new_folder, test::write_text, test::kPoses;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

/// The board as a camera for colour alone sees it, which stands 100 mm beside the other and is coarser.
class FromFilesWithColour : public FromFiles {
 protected:
  static constexpr double kBesideMm = 100;
  static Lens colour_lens() {
    Lens lens = small_rig().cameras[0].lens;
    lens.width_px = 600, lens.height_px = 450;
    lens.fx *= 0.7, lens.fy *= 0.7, lens.cx = 299.5, lens.cy = 224.5;
    return lens;
  }
  static void SetUpTestSuite() {
    colour_ = new_folder();
    PatternOptions options;
    options.projector_width_px = 640, options.projector_height_px = 400;
    Calibration rig = small_rig();
    RigidTransform colour_from_camera;
    colour_from_camera.translation.x() = -kBesideMm;
    rig.cameras[0].lens = colour_lens();
    rig.cameras[0].projector_from_camera = rig.cameras[0].projector_from_camera.after(colour_from_camera.inverse());
    for (int i = 0; i < kPoses; ++i) {
      write_simulated_pose(colour_ / ("pose_0" + std::to_string(i)), rig, *parse_board(kSimulatedBoard),
                           *make_pattern(options), colour_from_camera.after(simulated_pose(i)));
    }
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(colour_); }
  void SetUp() override {
    FromFiles::SetUp();
    write_text(home_ / "slsd.toml", configuration_text() +
                                        "[[camera]]\nname = \"colour\"\npath = \"colour.png\"\nuse = \"texture\"\n"
                                        "[[camera]]\nname = \"measure\"\npath = \"measure.png\"\n");
    request_.from = home_ / "captures";
    for (const auto& pose : std::filesystem::directory_iterator(captures().poses)) {
      const path name = pose.path().filename(), to = request_.from / name;
      std::filesystem::create_directories(to);
      std::filesystem::copy(pose.path(), to / "measure");
      std::filesystem::copy(colour_ / name, to / "colour");
    }
  }
  static path colour_;
};
path FromFilesWithColour::colour_;

/// Also if it stands first in the file: the first of the others gives the rig's frame.
TEST_F(FromFilesWithColour, CalibratesItAfterTheOthers) {
  const auto done = calibrate_from_files(request_);
  ASSERT_TRUE(done) << to_string(done.error());
  const Calibration found = kept();
  ASSERT_EQ(found.cameras.size(), 2U);
  EXPECT_EQ(found.cameras[0].name, "measure");
  EXPECT_EQ(found.cameras[0].rig_from_camera.translation.norm(), 0);
  const CalibratedCamera& colour = found.cameras[1];
  EXPECT_EQ(colour.name, "colour");
  EXPECT_EQ(colour.lens.width_px, colour_lens().width_px);
  EXPECT_NEAR(colour.lens.fx / colour_lens().fx, 1, 0.003);
  EXPECT_NEAR(colour.rig_from_camera.translation.x(), kBesideMm, 0.5);
  EXPECT_LT(Eigen::AngleAxisd(colour.rig_from_camera.rotation).angle() * 57.3, 0.15);
}

TEST_F(FromFilesWithColour, NeedsItsPictures) {
  request_.from = captures().poses;
  const std::string told = refusal();
  EXPECT_THAT(told, HasSubstr("has no pictures of camera \"colour\", and slsd starts only if"));
  EXPECT_THAT(told, HasSubstr("remove its [[camera]] table, or write the calibration elsewhere with --output"));
  request_.output = home_ / "elsewhere.yml";
  const auto done = calibrate_from_files(request_);
  EXPECT_TRUE(done) << to_string(done.error());
}

/// Its pictures have a third of the light in place of the pattern: each shows its own print.
TEST_F(FromFilesWithColour, CostsNoPoseIfItReadsNothing) {
  for (const auto& pose : std::filesystem::directory_iterator(request_.from)) {
    auto seen = read_image(pose.path() / "colour/white.png");
    ASSERT_TRUE(seen) << to_string(seen.error());
    auto& dim = std::get<Grey8>(*seen);
    std::transform(dim.data(), dim.data() + dim.size(), dim.data(),
                   [](std::uint8_t level) { return static_cast<std::uint8_t>(level / 3); });
    ASSERT_TRUE(write_file_atomically(pose.path() / "colour/pattern.png", *encode_png(dim)));
  }
  testing::internal::CaptureStdout();
  const std::string told = refusal(), said = testing::internal::GetCapturedStdout();
  EXPECT_THAT(told, HasSubstr("camera colour: only 0 of the poses can be used, but at least 3 are needed"));
  EXPECT_THAT(said, HasSubstr("pose_00 colour: not used: the board shows nothing of the projected pattern"));
  EXPECT_THAT(said, Not(ContainsRegex("pose_0.: not used")));
}

TEST_F(FromFilesWithColour, NeedsThreePosesThatItSees) {
  for (const char* pose : {"pose_00", "pose_02", "pose_04", "pose_05", "pose_06"})
    std::filesystem::remove_all(request_.from / pose / "colour");
  EXPECT_THAT(refusal(), HasSubstr("camera colour: only 2 of the poses can be used, but at least 3 are needed"));
}

}  // namespace
}  // namespace slsd
