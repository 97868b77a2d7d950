// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/decoder.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <random>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "tests/core/decode/decoded_scene.hpp"
#include "tests/core/decode/images.hpp"
#include "tests/core/decode/shipped_pattern.hpp"
#include "tests/core/threads.hpp"
#include "tests/drivers/allocations.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

using test::decode;
using test::decoder_of;
using test::frame_of;
using test::kCylinder;
using test::kPlane;
using test::kTilted;
using test::wrong_points;

DecodeOptions the_papers_way() {
  return {.binarize = Method::kPaper,
          .find_regions = Method::kPaper,
          .classify = Method::kPaper,
          .centre = Method::kPaper,
          .link_grid = Method::kPaper,
          .decode_windows = Method::kPaper,
          .correspond = Method::kPaper};
}

int visible_cells(const Pattern& pattern, const Surface& surface) {
  const Calibration rig = paper_rig();
  const double margin = 2 * pattern.options.symbol_size_px;
  int visible = 0;
  for (int row = 0; row < pattern.whole_rows(); ++row) {
    for (int column = 0; column < pattern.whole_columns(); ++column) {
      const auto seen =
          camera_from_projector({pattern.symbol_centre_u_px(column), pattern.symbol_centre_v_px(row)}, rig, surface);
      visible +=
          seen && seen->x() > margin && seen->y() > margin && seen->x() < 1599 - margin && seen->y() < 1199 - margin;
    }
  }
  return visible;
}

void expect_counts_sum_up(const Decoding& decoding) {
  EXPECT_EQ(std::accumulate(decoding.counts.begin(), decoding.counts.end(), std::size_t{0}), decoding.regions.size());
  EXPECT_EQ(decoding.count(RegionStatus::kDecoded), decoding.points.size());
}

struct Case {
  const char* name;
  const char* pattern;
  const Surface& surface;
  double least_share;  ///< of the visible cells
  double tolerance_px;
};

class DecodeScene : public testing::TestWithParam<Case> {};

TEST_P(DecodeScene, GivesMostSymbolsAndNoneWrong) {
  const Pattern pattern = shipped_pattern(GetParam().pattern);
  const Grey8 frame = frame_of(pattern, GetParam().surface);
  const int visible = visible_cells(pattern, GetParam().surface);
  Decoder decoder = decoder_of(pattern);
  const Decoding eight = decode(decoder, frame.view());
  EXPECT_GE(static_cast<double>(eight.points.size()), GetParam().least_share * visible);
  EXPECT_EQ(wrong_points(eight, GetParam().surface, GetParam().tolerance_px), 0);
  expect_counts_sum_up(eight);
  const Grey16 wide = sixteen_bits(frame);
  const Decoding sixteen = decode(decoder, wide.view());
  EXPECT_NEAR(static_cast<double>(sixteen.points.size()), static_cast<double>(eight.points.size()), 5);
  EXPECT_EQ(wrong_points(sixteen, GetParam().surface, GetParam().tolerance_px), 0);
  expect_counts_sum_up(sixteen);
}

INSTANTIATE_TEST_SUITE_P(Simulated, DecodeScene,
                         testing::Values(Case{"plane16", "16px-5.toml", kPlane, 0.97, 1},
                                         Case{"tilted16", "16px-5.toml", kTilted, 0.95, 1},
                                         Case{"cylinder16", "16px-5.toml", kCylinder, 0.85, 2},
                                         Case{"plane8", "8px-6.toml", kPlane, 0.95, 1},
                                         Case{"tilted8", "8px-6.toml", kTilted, 0.9, 1},
                                         Case{"cylinder8", "8px-6.toml", kCylinder, 0.75, 2}),
                         [](const auto& scene) { return std::string(scene.param.name); });

// The paper's array is unique in its aligned windows only, and its decoder knows neither phase nor epipolar line: one
// in twenty cells is wrong.
TEST(Decode, ThePapersWayGivesMostSymbols) {
  for (const char* name : {"paper-1.toml", "paper-2.toml"}) {
    const Pattern pattern = shipped_pattern(name);
    Decoder decoder = decoder_of(pattern, the_papers_way());
    const Decoding decoding = decode(decoder, frame_of(pattern, kPlane).view());
    EXPECT_GE(static_cast<double>(decoding.points.size()), 0.85 * visible_cells(pattern, kPlane)) << name;
    EXPECT_LE(wrong_points(decoding, kPlane, 3), static_cast<int>(decoding.points.size()) / 10) << name;
    expect_counts_sum_up(decoding);
  }
}

// Out of focus the gaps between symbols fill up. What ran together is taken apart whatever the mask came from, unless
// regions are to be as the paper has them.
TEST(Decode, TakesRegionsApartAfterEitherMask) {
  const Pattern pattern = shipped_pattern("8px-6-dense.toml");
  const Grey8 frame = simulate(draw_pattern(pattern), paper_rig(), kPlane, {.blur_sigma_px = 1.6});
  for (const Method binarize : {Method::kDefault, Method::kPaper}) {
    Decoder apart = decoder_of(pattern, {.binarize = binarize});
    Decoder merged = decoder_of(pattern, {.binarize = binarize, .find_regions = Method::kPaper});
    EXPECT_GT(decode(apart, frame.view()).regions.size(), decode(merged, frame.view()).regions.size() + 10);
  }
}

TEST(Decode, MeasuresThePlaneToAMillimetre) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  Decoder decoder = decoder_of(pattern);
  double squares = 0;
  const Decoding decoding = decode(decoder, frame_of(pattern, kPlane).view());
  ASSERT_FALSE(decoding.points.empty());
  for (const CloudPoint& point : decoding.points) {
    squares += (point.z - 2000) * (point.z - 2000);
    EXPECT_EQ(point.symbol, pattern.options.symbols[pattern.array.at(point.row, point.column)]);
    EXPECT_GT(point.sigma_mm, 0);
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(decoding.points.size())), 1);
}

TEST(Decode, FindsNoPointsInUniformFramesAndNoise) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  Decoder decoder = decoder_of(pattern);
  for (const int grey : {0, 255}) {
    const Decoding decoding = decode(decoder, Grey8(1600, 1200, static_cast<std::uint8_t>(grey)).view());
    EXPECT_THAT(decoding.points, testing::IsEmpty());
    EXPECT_THAT(decoding.regions, testing::IsEmpty());
  }
  Grey8 noise(1600, 1200);
  std::mt19937 random(3);
  for (std::size_t i = 0; i < noise.size(); ++i) noise.data()[i] = static_cast<std::uint8_t>(random() % 256);
  const Decoding decoding = decode(decoder, noise.view());
  EXPECT_THAT(decoding.points, testing::IsEmpty());
  expect_counts_sum_up(decoding);
}

TEST(Decode, ExcludesWhatLiesOutsideTheDepthRange) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  Decoder decoder = decoder_of(pattern, {.depth_min_mm = 400, .depth_max_mm = 1500});
  const Decoding decoding = decode(decoder, frame_of(pattern, kPlane).view());
  EXPECT_THAT(decoding.points, testing::IsEmpty());
  expect_counts_sum_up(decoding);
  const std::uint32_t no_cell_in_range =
      decoding.count(RegionStatus::kNoCodeword) + decoding.count(RegionStatus::kOutOfDepthRange);
  EXPECT_GT(no_cell_in_range, 0.9 * static_cast<double>(decoding.regions.size()));
}

TEST(Decode, GivesTheSameForTheSameFrameWhateverCameBefore) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  const Grey8 frame = frame_of(pattern, kTilted), other = frame_of(pattern, kCylinder, 2);
  Decoder decoder = decoder_of(pattern);
  const Decoding first = decode(decoder, frame.view());
  const Decoding again = decode(decoder, frame.view());
  const Decoding other_after = decode(decoder, other.view());
  const Decoding back = decode(decoder, frame.view());
  Decoder fresh = decoder_of(pattern);
  const Decoding other_alone = decode(fresh, other.view());
  for (const Decoding* same : {&again, &back}) {
    EXPECT_EQ(same->points, first.points);
    EXPECT_EQ(same->counts, first.counts);
  }
  EXPECT_EQ(other_after.points, other_alone.points);
  EXPECT_EQ(other_after.counts, other_alone.counts);
  EXPECT_NE(other_alone.points, first.points);
}

TEST(Decode, ReportsEachRegionAsItsPoint) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  Decoder decoder = decoder_of(pattern);
  const Decoding decoding = decode(decoder, frame_of(pattern, kCylinder).view());
  std::size_t point = 0;
  for (const RegionSeen& region : decoding.regions) {
    if (region.status != RegionStatus::kDecoded) {
      EXPECT_EQ(region.row, -1);
      continue;
    }
    ASSERT_LT(point, decoding.points.size());
    EXPECT_EQ(region.row, decoding.points[point].row);
    EXPECT_EQ(region.column, decoding.points[point].column);
    ++point;
  }
  EXPECT_EQ(point, decoding.points.size());
}

class Stages : public StageObserver {
 public:
  void stage_done(Stage stage) override { seen.push_back(stage); }
  std::vector<Stage> seen;
};

TEST(Decode, TellsOfEachStageOnceInOrder) {
  Decoder decoder = decoder_of(shipped_pattern("16px-5.toml"));
  const Grey8 frame(1600, 1200, 30);
  Stages stages;
  ASSERT_TRUE(decoder.decode(frame.view(), 255, &stages));
  EXPECT_THAT(stages.seen, testing::ElementsAre(Stage::kBinarize, Stage::kFindRegions, Stage::kDescribe,
                                                Stage::kClassify, Stage::kLinkGrid, Stage::kDecodeWindows,
                                                Stage::kReview, Stage::kCorrespond, Stage::kTriangulate));
}

TEST(Decode, RefusesAFrameOfAnotherSize) {
  Decoder decoder = decoder_of(shipped_pattern("16px-5.toml"));
  const Grey8 turned(1200, 1600), smaller(1600, 1199);
  for (const Grey8* frame : {&turned, &smaller}) {
    const auto decoding = decoder.decode(frame->view());
    ASSERT_FALSE(decoding);
    EXPECT_EQ(decoding.error().code, ErrorCode::kMismatch);
    EXPECT_THAT(decoding.error().message, testing::HasSubstr("1600x1200"));
  }
}

TEST(CreateDecoder, RefusesThePatternOfAnotherProjector) {
  Pattern pattern = shipped_pattern("16px-5.toml");
  pattern.options.projector_width_px = 1920;
  const auto decoder = Decoder::create(pattern, paper_rig(), 0, {});
  ASSERT_FALSE(decoder);
  EXPECT_EQ(decoder.error().code, ErrorCode::kMismatch);
  EXPECT_THAT(decoder.error().message, testing::HasSubstr("1920x800"));
}

TEST(CreateDecoder, RefusesACameraThatTheCalibrationLacks) {
  const auto decoder = Decoder::create(shipped_pattern("16px-5.toml"), paper_rig(), 1, {});
  ASSERT_FALSE(decoder);
  EXPECT_EQ(decoder.error().code, ErrorCode::kInvalidArgument);
}

TEST(CreateDecoder, RefusesImagesThatAreTooLarge) {
  Calibration rig = paper_rig();
  for (const auto& [width, height] : {std::pair(32768, 100), std::pair(100, 32768), std::pair(20000, 20000)}) {
    rig.cameras[0].lens.width_px = width, rig.cameras[0].lens.height_px = height;
    const auto decoder = Decoder::create(shipped_pattern("16px-5.toml"), rig, 0, {});
    ASSERT_FALSE(decoder);
    EXPECT_EQ(decoder.error().code, ErrorCode::kUnsupported);
    EXPECT_THAT(decoder.error().message, testing::HasSubstr("bin or crop"));
  }
}

// As wide and as high as may be; the length of a row once was kept in 16 bits.
TEST(Decode, ReadsTheLongestRowsAndColumns) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  const Grey8 symbols = draw_pattern(pattern);
  Calibration rig = paper_rig();
  for (const auto& [width, height] : {std::pair(32767, 70), std::pair(70, 32767)}) {
    rig.cameras[0].lens.width_px = width, rig.cameras[0].lens.height_px = height;
    auto decoder = Decoder::create(pattern, rig, 0, {});
    ASSERT_TRUE(decoder) << to_string(decoder.error());
    Grey8 frame(width, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) frame.at(x, y) = symbols.at(x % symbols.width(), y % symbols.height());
    }
    EXPECT_GT(decode(*decoder, frame.view()).regions.size(), 1000U);
    EXPECT_EQ(decode(*decoder, Grey8(width, height, 255).view()).points.size(), 0U);
  }
}

bool same_points(const Decoding& a, const Decoding& b) {
  const auto values = [](const CloudPoint& p) {
    return std::tuple(p.x, p.y, p.z, p.camera_u, p.camera_v, p.projector_u, p.projector_v, p.sigma_mm, p.symbol);
  };
  return a.counts == b.counts && std::ranges::equal(a.points, b.points, {}, values, values);
}

TEST(AnotherDecoder, ReadsAsTheFirstDoesInAThreadOfItsOwn) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  const Grey8 frames[] = {frame_of(pattern, kPlane), frame_of(pattern, kCylinder), frame_of(pattern, kTilted)};
  Decoder fresh = decoder_of(pattern);
  Decoder second = fresh.another();  // before the first frame: nothing has grown
  std::vector<Decoding> expected;
  for (const Grey8& frame : frames) expected.push_back(decode(fresh, frame.view()));
  Decoder third = fresh.another();
  const auto reads_the_same = [&](Decoder& decoder, bool& same) {
    for (int i = 0; i < 12; ++i) same = same && same_points(**decoder.decode(frames[i % 3].view()), expected[i % 3]);
  };
  bool first_same = true, second_same = true, third_same = true;
  {
    const std::jthread beside([&] { reads_the_same(second, second_same); });
    const std::jthread too([&] { reads_the_same(third, third_same); });
    reads_the_same(fresh, first_same);
  }
  EXPECT_TRUE(first_same && second_same && third_same);
  EXPECT_GT(expected[0].points.size(), 1000U);
}

TEST(AnotherDecoder, OutlivesTheFirst) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  const Grey8 frame = frame_of(pattern, kPlane);
  auto first = std::make_unique<Decoder>(decoder_of(pattern));
  const Decoding expected = decode(*first, frame.view());
  Decoder second = first->another();
  first.reset();
  EXPECT_TRUE(same_points(decode(second, frame.view()), expected));
}

TEST(CreateDecoder, GivesTheSamePointsBesideAnEarlierDecoder) {
  const Pattern small = shipped_pattern("8px-6.toml"), large = shipped_pattern("16px-5.toml");
  const IndexedPattern indexed(small);
  const Grey8 frame = frame_of(small, kPlane);
  Decoder alone = decoder_of(small);
  const Decoder of_large = decoder_of(large);
  const Decoding expected = decode(alone, frame.view());
  for (const Decoder* earlier : {&std::as_const(alone), &of_large}) {
    auto created = Decoder::create(indexed, paper_rig(), 0, {}, earlier);
    ASSERT_TRUE(created.has_value());
    EXPECT_TRUE(same_points(decode(*created, frame.view()), expected));
  }
}

// What lies beside an edge in depth is the first to go.
TEST(CreateDecoder, TakesLessForASmallerBudgetOfWrongCells) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  const Surface strips = [](const Ray& ray) {
    const int strip = static_cast<int>(std::floor(ray.direction.x() * 32));
    return plane({0, 0, strip % 2 == 0 ? 2000. : 1900.}, {0, 0, 1})(ray);
  };
  const Grey8 frame = frame_of(pattern, strips);
  std::size_t before = 0;
  for (const double budget : {1e-5, 1e-3, 1.}) {
    Decoder decoder = decoder_of(pattern, {.wrong_cells_max = budget});
    const std::size_t points = decode(decoder, frame.view()).points.size();
    EXPECT_GT(points, before) << budget;
    before = points;
  }
}

TEST(CreateDecoder, RefusesAnEmptyDepthRange) {
  const auto decoder =
      Decoder::create(shipped_pattern("16px-5.toml"), paper_rig(), 0, {.depth_min_mm = 900, .depth_max_mm = 800});
  ASSERT_FALSE(decoder);
  EXPECT_EQ(decoder.error().code, ErrorCode::kInvalidArgument);
}

TEST(CreateDecoder, CamerasShareOneCodebook) {
  const Pattern pattern = shipped_pattern("8px-6-dense.toml");
  const auto bytes_for = [&](const auto& of) {
    const std::uint64_t before = test::allocated_bytes();
    EXPECT_TRUE(Decoder::create(of, paper_rig(), 0, {}));
    return test::allocated_bytes() - before;
  };
  const std::uint64_t alone = bytes_for(pattern), one_of_several = bytes_for(IndexedPattern(pattern));
  if (alone == 0) GTEST_SKIP() << "nothing is counted here";
  const std::size_t cells = static_cast<std::size_t>(pattern.whole_rows()) * pattern.whole_columns();
  EXPECT_GE(alone, one_of_several + cells * (sizeof(std::uint32_t) + 2 * sizeof(Codebook::Entry)));
}

/// Frames that take every way through the stages: light that falls off, noise, edges in depth, out of focus, 16 bits.
struct Views {
  Pattern pattern = shipped_pattern("16px-5.toml");
  Grey8 cylinder = frame_of(pattern, kCylinder), tilted = frame_of(pattern, kTilted), blurred;
  Grey16 wide = sixteen_bits(cylinder);

  Views() {
    SimulationOptions out_of_focus;
    out_of_focus.blur_sigma_px = 2.5;
    blurred = simulate(draw_pattern(pattern), paper_rig(), kTilted, out_of_focus);
  }
  [[nodiscard]] std::vector<GreyView> all() const {
    return {cylinder.view(), tilted.view(), blurred.view(), wide.view()};
  }
};

bool same(const RegionSeen& a, const RegionSeen& b) {
  return a.centre_px == b.centre_px && a.status == b.status && a.letter == b.letter && a.links == b.links &&
         a.broken == b.broken && a.column == b.column && a.row == b.row;
}

TEST(Decoder, WorkersChangeNothing) {
  const Views views;
  for (const GreyView& frame : views.all()) {
    Decoder decoder = decoder_of(views.pattern);
    const Decoding alone = decode(decoder, frame);
    ASSERT_GT(alone.points.size(), 500U);
    for (const int workers : {1, 2, 3}) {
      test::Threads threads(workers);
      const auto together = decoder.decode(frame, std::nullopt, nullptr, &threads);
      ASSERT_TRUE(together);
      EXPECT_EQ((*together)->points, alone.points);
      EXPECT_EQ((*together)->counts, alone.counts);
      EXPECT_TRUE(std::ranges::equal((*together)->regions, alone.regions, same));
    }
  }
}

/// As many workers as asked for, one after the other, so that it is known who does what.
class InTurn final : public Executor {
 public:
  explicit InTurn(int workers) : workers_(workers) {}
  [[nodiscard]] int workers() const override { return workers_; }

 protected:
  void run_parts(int parts, Part part, const void* work) override {
    for (int i = 0; i < parts; ++i) part(work, i, (i + turn_) % workers_);
    ++turn_;
  }

 private:
  int workers_, turn_ = 0;
};

TEST(Decoder, AllocatesNothingAfterTheFirstFrame) {
  const Views views;
  for (const int workers : {1, 3}) {
    Decoder decoder = decoder_of(views.pattern);
    InTurn executor(workers);
    ASSERT_TRUE(decoder.decode(views.cylinder.view(), 255, nullptr, &executor));
    const auto before = test::allocations();
    for (int frame = 0; frame < 3; ++frame) ASSERT_TRUE(decoder.decode(views.cylinder.view(), 255, nullptr, &executor));
    EXPECT_EQ(test::allocations(), before) << workers << " workers";
  }
}

}  // namespace
}  // namespace slsd
