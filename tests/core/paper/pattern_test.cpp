// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <gmock/gmock.h>
#include <opencv2/imgproc.hpp>

#include "core/code/pattern.hpp"
#include "core/paper/binarize.hpp"
#include "core/paper/classify.hpp"
#include "core/paper/decode_windows.hpp"
#include "core/paper/link_grid.hpp"
#include "tests/core/decode/images.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

struct Read {
  std::vector<PaperRegion> regions;
  std::vector<int> letters;
  std::vector<Links> links;
  std::vector<std::optional<ArrayCell>> cells;
};

Pattern paper_pattern(std::vector<int> symbols) {
  PatternOptions options;
  options.symbols = std::move(symbols);
  options.method = ArrayMethod::kConstructive;
  auto pattern = make_pattern(options);
  EXPECT_TRUE(pattern) << (pattern ? "" : pattern.error().message);
  return *pattern;
}

cv::Mat1b as_mat(Grey8& image) {
  return {image.height(), image.width(), image.data()};
}

// A symbol cut by the frame's border may look like another.
void remove_cut_regions(Grey8& mask) {
  const cv::Mat1b image = as_mat(mask);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const bool border = x == 0 || y == 0 || x == image.cols - 1 || y == image.rows - 1;
      if (border && image(y, x)) cv::floodFill(image, {x, y}, 0, nullptr, {}, {}, 8);
    }
  }
}

// Regions by OpenCV, so that the paper's stages are tested apart from the decoder's own.
std::vector<PaperRegion> regions_of(Grey8& mask, Image<std::int32_t>& labels) {
  cv::Mat1i numbers;
  cv::Mat1d centroids;
  cv::Mat1i boxes;
  const int count = cv::connectedComponentsWithStats(as_mat(mask), numbers, boxes, centroids);
  std::transform(numbers.begin(), numbers.end(), labels.data(), [](int number) { return number - 1; });
  std::vector<PaperRegion> regions;
  for (int i = 1; i < count; ++i) {
    const cv::Rect box(boxes(i, 0), boxes(i, 1), boxes(i, 2), boxes(i, 3));
    Grey8 own(box.width, box.height);
    cv::compare(numbers(box), i, as_mat(own), cv::CMP_EQ);
    PaperRegion region{describe_shape(own), -1};
    region.shape.centroid_px += Eigen::Vector2d(box.x, box.y);
    regions.push_back(region);
  }
  return regions;
}

Read read(const Pattern& pattern, const Grey8& frame, double scale) {
  Grey8 mask = grey_of(binarize_paper(frame.view()));
  remove_cut_regions(mask);
  Image<std::int32_t> labels(mask.width(), mask.height());
  Read result{regions_of(mask, labels), {}, {}, {}};
  const auto& [symbols, size_px, spacing_px] =
      std::tie(pattern.options.symbols, pattern.options.symbol_size_px, pattern.options.spacing_px);
  const auto thresholds = make_thresholds(symbols, size_px);
  for (PaperRegion& region : result.regions) {
    region.letter = classify_paper(region.shape, *thresholds, scale * size_px);
    result.letters.push_back(region.letter);
  }
  result.links = link_grid_paper(result.regions, labels, make_paper_grid(symbols, size_px, spacing_px));
  result.cells = decode_windows_paper(result.letters, result.links, pattern.array);
  return result;
}

struct Score {
  int right = 0, wrong = 0;
};

// Against the cell that the region's centroid lies in, by the projector pixel under it.
template <class ProjectorPixel>
Score score_by(const Pattern& pattern, const Read& read, ProjectorPixel projector_pixel) {
  Score score;
  for (std::size_t i = 0; i < read.regions.size(); ++i) {
    if (!read.cells[i]) continue;
    const Eigen::Vector2d place = projector_pixel(read.regions[i].shape.centroid_px) / pattern.pitch_px();
    const ArrayCell lies_in{static_cast<int>(place.y()), static_cast<int>(place.x())};
    (*read.cells[i] == lies_in ? score.right : score.wrong) += 1;
  }
  return score;
}

TEST(PaperStages, DecodeEveryWholeSymbolOfBothPaperPatterns) {
  for (const std::vector<int>& symbols : {std::vector<int>{5, 7, 22}, {25, 7, 22}}) {
    const Pattern pattern = paper_pattern(symbols);
    const Read result = read(pattern, draw_pattern(pattern), 1);
    const Score score = score_by(pattern, result, [](const Eigen::Vector2d& pixel) { return pixel; });
    EXPECT_EQ(score.wrong, 0);
    EXPECT_GE(score.right, pattern.whole_columns() * pattern.whole_rows());
  }
}

// The paper's way is not free of wrong cells: what is left of a symbol at the pattern's edge reads as another letter.
TEST(PaperStages, DecodeMostOfAPlane) {
  const Calibration rig = paper_rig();
  const Surface wall = plane({0, 0, 2000}, {0, 0, 1});
  for (const std::vector<int>& symbols : {std::vector<int>{5, 7, 22}, {25, 7, 22}}) {
    const Pattern pattern = paper_pattern(symbols);
    const Grey8 frame = simulate(draw_pattern(pattern), rig, wall);
    const Read result = read(pattern, frame, rig.cameras[0].lens.fx / rig.projector.fx);
    const Score score = score_by(
        pattern, result, [&](const Eigen::Vector2d& pixel) { return projector_from_camera(pixel, rig, wall).value(); });
    EXPECT_LE(score.wrong, score.right / 200);
    EXPECT_GE(score.right, std::ssize(result.regions) * 85 / 100);
  }
}

TEST(LinkGridPaper, LinksRightAndDownWithLeftAndUp) {
  const Pattern pattern = paper_pattern({5, 7, 22});
  const Read result = read(pattern, draw_pattern(pattern), 1);
  int linked = 0;
  for (std::size_t i = 0; i < result.links.size(); ++i) {
    for (const auto& [there, back] : {std::pair{kRight, kLeft}, {kDown, kUp}}) {
      const std::int32_t neighbour = result.links[i][there];
      if (neighbour < 0) continue;
      ++linked;
      EXPECT_EQ(result.links[static_cast<std::size_t>(neighbour)][back], static_cast<std::int32_t>(i));
    }
  }
  EXPECT_GT(linked, 2 * 44 * 70 - 200);
}

TEST(DecodeWindowsPaper, ACodewordThatOccursTwiceIsTheFirst) {
  CodeArray array{3,
                  6,
                  2,
                  {0, 1, 0, 0, 1, 0,  //
                   1, 1, 0, 1, 1, 0,  //
                   0, 0, 1, 0, 0, 1}};
  const std::vector<int> letters{0, 1, 0, 1, 1, 0, 0, 0, 1};
  const std::vector<Links> links{{1, 3, -1, -1}, {2, 4, 0, -1},  {-1, 5, 1, -1}, {4, 6, -1, 0}, {5, 7, 3, 1},
                                 {-1, 8, 4, 2},  {7, -1, -1, 3}, {8, -1, 6, 4},  {-1, -1, 7, 5}};
  const auto cells = decode_windows_paper(letters, links, array);
  EXPECT_EQ(cells[0], (ArrayCell{0, 0}));
  EXPECT_EQ(cells[8], (ArrayCell{2, 2}));
}

TEST(DecodeWindowsPaper, AnUnknownLetterSpoilsItsWindow) {
  CodeArray array{3, 3, 2, {0, 1, 0, 1, 1, 0, 0, 0, 1}};
  const std::vector<int> letters{0, 1, 0, 1, -1, 0, 0, 0, 1};
  const std::vector<Links> links{{1, 3, -1, -1}, {2, 4, 0, -1},  {-1, 5, 1, -1}, {4, 6, -1, 0}, {5, 7, 3, 1},
                                 {-1, 8, 4, 2},  {7, -1, -1, 3}, {8, -1, 6, 4},  {-1, -1, 7, 5}};
  EXPECT_THAT(decode_windows_paper(letters, links, array), testing::Each(std::nullopt));
}

}  // namespace
}  // namespace slsd
