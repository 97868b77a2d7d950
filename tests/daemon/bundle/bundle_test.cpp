// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/bundle/bundle.hpp"

#include <algorithm>
#include <fstream>

#include <gmock/gmock.h>

#include "daemon/bundle/bundle_store.hpp"
#include "daemon/configuration/configuration.hpp"
#include "drivers/recording/layout.hpp"
#include "tests/daemon/configuration/read_text.hpp"
#include "tests/drivers/temporary_folder.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::system_clock;
using test::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(ReadTar, GivesBackWhatWasWritten) {
  const std::string block(512, 'b');
  TarWriter writer(system_clock::time_point(1h));
  for (const auto& [name, bytes] : {std::pair<std::string, std::string>("a", ""), {"b/-c.txt", block}, {"d", "e"}})
    writer.add(name, bytes);
  const std::string archive = std::move(writer).finish();
  const auto files = read_tar(archive);
  ASSERT_TRUE(files) << to_string(files.error());
  ASSERT_EQ(files->size(), 3U);
  EXPECT_EQ((*files)[0].bytes, "");
  EXPECT_EQ((*files)[1].name, "b/-c.txt");
  EXPECT_EQ((*files)[1].bytes, block);
  EXPECT_EQ((*files)[2].bytes, "e");
}

TEST(ReadTar, RefusesEachBitThatIsTurnedInAHeader) {
  TarWriter writer(system_clock::time_point(1h));
  writer.add("name", "bytes");
  std::string archive = std::move(writer).finish();
  for (std::size_t bit = 0; bit < 8 * 512; ++bit) {
    archive[bit / 8] = static_cast<char>(archive[bit / 8] ^ (1 << bit % 8));
    const auto files = read_tar(archive);
    if (files) {  // a blank in the place of the zero after a number
      ASSERT_EQ(files->size(), 1U) << bit;
      EXPECT_EQ(files->front().name + std::string(files->front().bytes), "namebytes") << bit;
    }
    archive[bit / 8] = static_cast<char>(archive[bit / 8] ^ (1 << bit % 8));
  }
}

TEST(DecodeKeys, AreEveryKeyThere) {
  const auto come_back = [](const DecodeOptions& options) {
    const nlohmann::json settings{{"configuration", {{"decode", decode_keys(options)}}}};
    const auto read = test::read(replay_configuration(settings, {}));
    ASSERT_TRUE(read) << to_string(read.error());
    EXPECT_EQ(read->decode, options);
  };
  DecodeOptions options;
  options.depth_min_mm = 123.456789012345678;
  options.depth_max_mm = 2345.6;
  options.precision = Precision::kFine;
  come_back(options);
  options.precision = Precision::kStandard;
  options.density = Density::kPixels;
  options.wrong_cells_max = 0.0005;
  options.dense = {.stride_px = 7, .prune_px = 2.25};
  come_back(options);
  options.density = Density::kSymbols;
  for (Method* method : {&options.binarize, &options.find_regions, &options.classify, &options.centre,
                         &options.link_grid, &options.decode_windows, &options.correspond}) {
    *method = Method::kPaper;
    come_back(options);
  }
}

TEST(CloudKeys, AreEveryKeyThere) {
  for (const CloudOptions& options :
       {CloudOptions{}, CloudOptions{.box = {-0.1, 1e-9, 123.456789012345678, 1, 2, 1234.5},
                        .plane = {0, 0.6, -0.8, 1e-3},
                        .box_frame = CoordinateFrame::kRobotBase,
                        .voxel_mm = 0.7,
                        .stride = 3}}) {
    nlohmann::json settings{{"configuration", {{"cloud", cloud_keys(options)}}}, {"hand_eye_file", ""}};
    const auto read = test::read(replay_configuration(settings, {}));
    ASSERT_TRUE(read) << to_string(read.error());
    EXPECT_EQ(read->cloud, options);
    EXPECT_EQ(read->frame.hand_eye, "etc/hand_eye.yml");  // beside the configuration
  }
}

class BundleStoreTest : public ::testing::Test {
 protected:
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const auto& each : std::filesystem::directory_iterator(folder_.path() / "bundles"))
      names.push_back(each.path().filename().string());
    std::ranges::sort(names);
    return names;
  }
  TemporaryFolder folder_;
  BundleStore store_{folder_.path() / "bundles", 1000};
  system_clock::time_point now_ = system_clock::time_point(1'000'000h);
  const Error torn_{ErrorCode::kFrameTorn, "torn", "camera left"};
};

TEST_F(BundleStoreTest, TakesEachWayOnceAndPausesBetween) {
  EXPECT_TRUE(store_.claim(torn_, now_));
  EXPECT_FALSE(store_.claim(torn_, now_ + 24h));
  const Error other{ErrorCode::kFrameTorn, "torn", "camera right"};
  EXPECT_FALSE(store_.claim(other, now_ + 9min));
  EXPECT_TRUE(store_.claim(other, now_ + 10min));
}

TEST_F(BundleStoreTest, KnowsAWayAsLongAsItsBundleIsThere) {
  ASSERT_TRUE(store_.claim(torn_, now_));
  const auto file = store_.put(torn_, "bytes", now_);
  ASSERT_TRUE(file) << to_string(file.error());
  EXPECT_THAT(names(), ElementsAre("20840129T160000Z-frame_torn-camera_left.tar"));
  EXPECT_FALSE(BundleStore(folder_.path() / "bundles", 1000).claim(torn_, now_));
  std::filesystem::remove(*file);
  EXPECT_TRUE(BundleStore(folder_.path() / "bundles", 1000).claim(torn_, now_));
}

TEST_F(BundleStoreTest, LeavesOutWhatIsTheClients) {
  for (const ErrorCode code : {ErrorCode::kCancelled, ErrorCode::kBusy, ErrorCode::kNotFound})
    EXPECT_FALSE(store_.claim({code, "message", {}}, now_));
  EXPECT_TRUE(store_.claim({ErrorCode::kNotFound, "message", "frames/0.png"}, now_));
  EXPECT_FALSE(BundleStore({}, 1000).claim(torn_, now_));
  EXPECT_FALSE(BundleStore(folder_.path(), 0).claim(torn_, now_));
}

TEST_F(BundleStoreTest, KeepsTheNewestWithinItsBounds) {
  for (int i = 0; i < 12; ++i) {
    ASSERT_TRUE(store_.put(torn_, std::string(10, 'x'), now_ + i * 1h));
    EXPECT_LE(names().size(), BundleStore::kFilesMax);
  }
  EXPECT_THAT(names().front(), HasSubstr("20840129T2000"));
  ASSERT_TRUE(store_.put(torn_, std::string(975, 'x'), now_ + 20h));
  EXPECT_EQ(names().size(), 3U);
  EXPECT_EQ(store_.put(torn_, std::string(1001, 'x'), now_ + 21h).error().code, ErrorCode::kNoSpace);
  EXPECT_EQ(names().size(), 3U);
}

// What is not ours stays, however the disk fills.
TEST_F(BundleStoreTest, RemovesNothingOfOthers) {
  std::filesystem::create_directories(folder_.path() / "bundles");
  std::ofstream(folder_.path() / "bundles" / "calibration.yml") << std::string(2000, 'x');
  ASSERT_TRUE(store_.put(torn_, std::string(900, 'x'), now_));
  EXPECT_EQ(names().size(), 2U);
}

}  // namespace
}  // namespace slsd
