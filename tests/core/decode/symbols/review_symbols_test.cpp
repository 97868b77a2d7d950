// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/review_symbols.hpp"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <opencv2/imgproc.hpp>

#include "core/decode/grid/link_grid.hpp"
#include "tests/core/decode/alone.hpp"
#include "tests/core/decode/shipped_pattern.hpp"

namespace slsd {
namespace {

constexpr int kCells = 10, kScale = 2, kPitchPx = 18 * kScale;
constexpr int kSidePx = kCells * kPitchPx;

/// The first ten by ten cells as a camera sees them that stands right in front, with known cells.
class ReviewSymbols : public testing::Test {
 protected:
  ReviewSymbols() : pattern_(shipped_pattern("16px-5.toml")) {
    PrototypeOptions options;
    options.symbols = pattern_.options.symbols;
    options.camera_px_per_projector_px = kScale;
    prototypes_ = make_prototypes(options);
    Grey8 drawn = draw_pattern(pattern_);
    const cv::Mat1b image(drawn.height(), drawn.width(), drawn.data());
    cv::Mat1b larger;
    cv::resize(image(cv::Rect(0, 0, kSidePx / kScale, kSidePx / kScale)), larger, {kSidePx, kSidePx}, 0, 0,
               cv::INTER_NEAREST);
    larger.convertTo(light_, CV_32F, 150. / 255);
  }

  /// Exposes, finds the regions, links them and claims for each the cell that it lies in.
  void look() {
    cv::Mat1f exposed;
    cv::GaussianBlur(light_, exposed, {}, 1);
    exposed += 20;
    frame_ = Grey8(kSidePx, kSidePx);
    cv::Mat1b frame(kSidePx, kSidePx, frame_.data()), lit;
    exposed.convertTo(frame, CV_8U);
    Grey8 mask(kSidePx, kSidePx);
    lit = cv::Mat1b(kSidePx, kSidePx, mask.data());
    cv::threshold(frame, lit, 60, 255, cv::THRESH_BINARY);
    RegionFinder().find(Mask(mask.view()), regions_);
    for (std::size_t i = 0; i < regions_.regions.size(); ++i) add(i);
    linker_.link(seen_.nodes, alone);
  }

  void add(std::size_t index) {
    const Region& region = regions_.regions[index];
    seen_.region.push_back(static_cast<std::int32_t>(index));
    const GreyMoments moments = meter_.measure(frame_.view(), region, regions_.runs_of(region));
    const auto row = static_cast<std::int16_t>(moments.y / kPitchPx),
               column = static_cast<std::int16_t>(moments.x / kPitchPx);
    seen_.moments.push_back(moments);
    const LatticeFrame frame = kScale * LatticeFrame::Identity();
    const Eigen::Vector2f centre =
        Eigen::Vector2f(moments.x, moments.y) - frame * prototypes_[pattern_.array.at(row, column)].centroid_px;
    seen_.nodes.push_back({centre, frame});
    seen_.shapes.emplace_back();
    seen_.claims.push_back({row, column, 20, RegionStatus::kDecoded});
    seen_.aligned.push_back(Aligned::kNot);
  }

  void review() {
    SymbolReview(pattern_, {})
        .review(frame_.view(), regions_, linker_, {prototypes_, Classifier(prototypes_, 20)}, std::span(&meter_, 1),
                alone, seen_);
  }

  [[nodiscard]] std::size_t sighting_at(int row, int column) const {
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      if (seen_.claims[i].same_cell(row, column)) return i;
    }
    ADD_FAILURE() << "nothing at " << row << ", " << column;
    return 0;
  }

  /// RMS over the inner symbols of the centroid's distance from where the pattern has it, camera px.
  [[nodiscard]] double centre_error() const {
    double squares = 0;
    int count = 0;
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      const auto [row, column] = std::pair(seen_.claims[i].row, seen_.claims[i].column);
      if (row < 2 || column < 2 || row >= kCells - 2 || column >= kCells - 2) continue;
      const Eigen::Vector2d square(pattern_.symbol_centre_u_px(column), pattern_.symbol_centre_v_px(row));
      const Eigen::Vector2f truth =
          (square.cast<float>() + prototypes_[pattern_.array.at(row, column)].centroid_px).array() * kScale + 0.5F;
      squares += (Eigen::Vector2f(seen_.moments[i].x, seen_.moments[i].y) - truth).squaredNorm();
      ++count;
    }
    return std::sqrt(squares / count);
  }

  [[nodiscard]] int count(RegionStatus status) const {
    return static_cast<int>(
        std::ranges::count_if(seen_.claims, [&](const CellClaim& claim) { return claim.status == status; }));
  }

  Pattern pattern_;
  std::vector<Prototype> prototypes_;
  cv::Mat1f light_;
  Grey8 frame_;
  Regions regions_;
  Sightings seen_;
  GridLinker linker_{{}};
  GreyMomentMeter meter_{2};
};

TEST_F(ReviewSymbols, LeavesWholeSymbols) {
  look();
  ASSERT_EQ(seen_.size(), static_cast<std::size_t>(kCells * kCells));
  review();
  EXPECT_EQ(count(RegionStatus::kDecoded), kCells * kCells);
  EXPECT_LT(centre_error(), 0.1);
}

TEST_F(ReviewSymbols, RejectsASymbolThatIsCut) {
  // The right third of a cell in shadow.
  light_(cv::Rect(5 * kPitchPx + 2 * kPitchPx / 3, 4 * kPitchPx, kPitchPx / 3, kPitchPx)) = 0;
  look();
  review();
  EXPECT_EQ(seen_.claims[sighting_at(4, 5)].status, RegionStatus::kDamagedShape);
  EXPECT_EQ(count(RegionStatus::kDamagedShape), 1);
  EXPECT_EQ(count(RegionStatus::kDecoded), kCells * kCells - 1);
}

// Its neighbours put it where the next one is, which is whole and has the same letter.
TEST_F(ReviewSymbols, FindsNoSymbolWhereAnotherIs) {
  int row = 3, column = 3;
  while (pattern_.array.at(row, column) != pattern_.array.at(row, column + 1))
    if (++column == kCells - 4) ++row, column = 3;
  ASSERT_LT(row, kCells - 3);
  light_(cv::Rect(column * kPitchPx, row * kPitchPx, kPitchPx / 3, kPitchPx)) = 0;
  look();
  const std::size_t cut = sighting_at(row, column);
  for (const Direction d : kDirections) {
    auto node = static_cast<std::int32_t>(cut);
    for (int links = 0; links < 3; ++links) node = seen_.nodes[node].links[d];
    seen_.nodes[node].centre_px.x() += kPitchPx;
  }
  const float before = seen_.moments[cut].x;
  review();
  EXPECT_NEAR(seen_.moments[cut].x, before, 0.25 * kPitchPx);
  EXPECT_EQ(seen_.claims[cut].status, RegionStatus::kDamagedShape);
}

TEST_F(ReviewSymbols, TakesTheFramesAroundForOneThatIsOffOnTheGridAlone) {
  for (const GridFit fit : {GridFit::kNone, GridFit::kLoose, GridFit::kTight}) {
    seen_ = {};
    look();
    const std::size_t at_boundary = sighting_at(0, 5);
    seen_.claims[at_boundary].grid_fit = fit;
    // Print has moved the centre of the one below.
    seen_.nodes[sighting_at(1, 5)].centre_px.y() += 0.2F * kPitchPx;
    linker_.measure_frame(seen_.nodes, std::vector<std::uint8_t>(seen_.size(), 1), at_boundary);
    review();
    EXPECT_EQ(seen_.claims[at_boundary].status == RegionStatus::kDecoded, fit != GridFit::kNone);
  }
}

TEST_F(ReviewSymbols, LevelsTheLight) {
  for (int x = 0; x < kSidePx; ++x) light_.col(x) *= std::exp(-0.12 * x / kPitchPx);
  look();
  const double before = centre_error();
  review();
  EXPECT_GT(before, 0.05);
  EXPECT_LT(centre_error(), 0.6 * before);
  EXPECT_GE(count(RegionStatus::kDecoded), kCells * kCells * 95 / 100);
}

TEST_F(ReviewSymbols, LeavesWhatWasAlignedWhereItIs) {
  light_.col(kSidePx / 2) *= 0.2;
  look();
  for (Aligned& aligned : seen_.aligned) aligned = Aligned::kWhole;
  const std::vector<GreyMoments> before = seen_.moments;
  review();
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(seen_.moments[i].x, before[i].x) << i;
  EXPECT_EQ(count(RegionStatus::kDecoded), kCells * kCells);
}

TEST_F(ReviewSymbols, LooksAtNoSymbolThatWasRejected) {
  look();
  seen_.claims[33].status = RegionStatus::kClassDisagrees;
  const float x = seen_.moments[33].x;
  review();
  EXPECT_EQ(seen_.claims[33].status, RegionStatus::kClassDisagrees);
  EXPECT_EQ(seen_.moments[33].x, x);
}

}  // namespace
}  // namespace slsd
