// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <cmath>

#include "core/decode/centres/mend_symbols.hpp"
#include "tests/core/decode/centres/mended_plane.hpp"

namespace slsd {
namespace {

/// None of the plane stands: each is damaged, and its centroid has gone across its line, as beneath lines of print.
class MendGroups : public test::MendedPlane {
 protected:
  static constexpr int kCount = kSide * kSide;
  MendGroups() {
    for (int i = 0; i < kCount; ++i) {
      seen_.claims[i].status = RegionStatus::kDamagedShape;
      see(i, true_centre(i / kSide, i % kSide) + Eigen::Vector2f(0, 1.2F + 0.2F * static_cast<float>(i % 3)));
    }
  }

  /// Where its centroid is then.
  void see(int node, const Eigen::Vector2f& centre_px) {
    const EpipolarGate gate(rig_.cameras[0], rig_.projector, 400, 3200);
    seen_.nodes[node].centre_px = centre_px;
    seen_.moments[node].x = centre_px.x(), seen_.moments[node].y = centre_px.y();
    segments_[node] = gate.prepare(pixel_ray(rig_.cameras[0].lens, centre_px.cast<double>()).direction);
  }
  /// Leaves no light in all cells but these.
  void darken_all_but(std::initializer_list<int> lit) {
    const Grey8 whole = frame_;
    frame_ = Grey8(whole.width(), whole.height());
    std::fill_n(frame_.data(), static_cast<std::size_t>(whole.width()) * whole.height(), std::uint8_t{12});
    for (const int node : lit) {
      const Eigen::Vector2f centre = true_centre(node / kSide, node % kSide);
      const int u = static_cast<int>(std::lround(centre.x())), v = static_cast<int>(std::lround(centre.y()));
      for (int y = v - 9; y <= v + 9; ++y)
        for (int x = u - 9; x <= u + 9; ++x) frame_.at(x, y) = whole.at(x, y);
    }
  }
  /// Ends the frame so many columns to the right of the last of the first row.
  void cut_beyond(int columns_px) {
    const Grey8 whole = frame_;
    frame_ = Grey8(static_cast<int>(true_centre(0, kSide - 1).x()) + columns_px, whole.height());
    for (int y = 0; y < whole.height(); ++y) std::copy_n(whole.row(y), frame_.width(), frame_.row(y));
  }
  /// One that is well seen, and of nothing that is known.
  void put_other_light_at(int node) {
    seen_.claims[node] = {.status = RegionStatus::kNoCodeword};
    seen_.shapes[node].letter = 0, seen_.shapes[node].distance = 1;
  }
  /// How many are mended where all are seen so far along their lines from where they are.
  std::size_t mended_from(float along_px) {
    const Sightings all = seen_;
    for (int i = 0; i < kCount; ++i) seen_.nodes[i].centre_px.x() += along_px, seen_.moments[i].x += along_px;
    const std::size_t mended = mend_all().size();
    seen_ = all;
    return mended;
  }
  [[nodiscard]] float off_px(int node) const {
    const GreyMoments& moments = seen_.moments[node];
    return (Eigen::Vector2f(moments.x, moments.y) - true_centre(node / kSide, node % kSide)).norm();
  }
};

TEST_F(MendGroups, HoldEachOther) {
  const auto mended = mend_all();
  EXPECT_EQ(mended.size(), kCount);
  for (const std::int32_t node : mended) {
    EXPECT_LT(off_px(node), 0.1F) << node;
    EXPECT_EQ(seen_.claims[node].status, RegionStatus::kDecoded);
  }
}

TEST_F(MendGroups, AreFoundBeneathLinesOfPrint) {
  for (int node = 0; node < kCount; ++node) {
    const Eigen::Vector2f centre = true_centre(node / kSide, node % kSide);
    for (int y = -1; y <= 2; ++y) {
      for (int x = -10; x <= 10; ++x) {
        std::uint8_t& level =
            frame_.at(static_cast<int>(std::lround(centre.x())) + x, static_cast<int>(std::lround(centre.y())) + y);
        level = static_cast<std::uint8_t>(std::lround(0.5 * level));
      }
    }
  }
  const auto mended = mend_all();
  EXPECT_EQ(mended.size(), kCount);
  for (const std::int32_t node : mended) EXPECT_LT(off_px(node), 0.3F) << node;
}

TEST_F(MendGroups, AreOfThreeAtLeast) {
  const Grey8 whole = frame_;
  const Sightings all = seen_;
  const auto mended_of = [&](std::initializer_list<int> lit) {
    frame_ = whole, seen_ = all;
    darken_all_but(lit);
    return mend_all();
  };
  EXPECT_THAT(mended_of({11, 12, 13}), testing::ElementsAre(11, 12, 13));
  EXPECT_THAT(mended_of({11, 12, 17}), testing::ElementsAre(11, 12, 17));
  EXPECT_THAT(mended_of({11, 12}), testing::IsEmpty());
  EXPECT_THAT(mended_of({11, 12, 14}), testing::IsEmpty()) << "the third lies apart";
}

// What is refused comes back with them, too.
TEST_F(MendGroups, AreOfAllThatHaveACell) {
  const Sightings all = seen_;
  for (const RegionStatus status : {RegionStatus::kNeighboursDisagree, RegionStatus::kOffEpipolarLine}) {
    seen_ = all;
    seen_.claims[kWorn].status = status;
    EXPECT_THAT(mend_all(), testing::Contains(static_cast<std::int32_t>(kWorn))) << static_cast<int>(status);
  }
  for (const RegionStatus status : {RegionStatus::kClassDisagrees, RegionStatus::kOutOfDepthRange}) {
    seen_ = all;
    seen_.claims[kWorn].status = status;
    EXPECT_THAT(mend_all(), testing::Not(testing::Contains(static_cast<std::int32_t>(kWorn))));
  }
}

TEST_F(MendGroups, LieBesideNoOtherLight) {
  const Sightings all = seen_;
  put_other_light_at(0);
  EXPECT_THAT(mend_all(), testing::IsEmpty()) << "eight links lead from one corner to the other";
  seen_ = all;
  put_other_light_at(0);
  seen_.shapes[0].distance = 4;
  EXPECT_EQ(mend_all().size(), kCount - 1) << "what is worn itself says nothing";
}

// A symbol that no island has named is of their surface where its letter is the pattern's there, another island's where
// its cell is.
TEST_F(MendGroups, LieBesideTheirOwnLight) {
  const Sightings all = seen_;
  const int letter = pattern_.array.at(kRow, kColumn);
  const auto mended_beside = [&](const CellClaim& claim, int shown) {
    seen_ = all;
    put_other_light_at(0);
    seen_.claims[0] = claim, seen_.shapes[0].letter = static_cast<std::int8_t>(shown);
    return mend_all().size();
  };
  const int other_letter = (letter + 1) % static_cast<int>(pattern_.options.symbols.size());
  const CellClaim unnamed{.status = RegionStatus::kNoCodeword};
  EXPECT_EQ(mended_beside(unnamed, letter), kCount - 1);
  EXPECT_EQ(mended_beside(unnamed, other_letter), 0);
  CellClaim named{.row = kRow, .column = kColumn, .status = RegionStatus::kDamagedShape, .island = 1};
  EXPECT_EQ(mended_beside(named, letter), kCount) << "of another island, and where the pattern has it";
  named.column += 7;
  EXPECT_EQ(mended_beside(named, letter), 0) << "the same letter, elsewhere";
}

// One beside it tells of its light; where it is, all those around it.
TEST_F(MendGroups, HaveOneBesideThem) {
  darken_all_but({11, 12, 13});
  const Sightings all = seen_;
  const auto cut = [&](int node, Direction d, int other) {
    seen_.nodes[node].links[d] = -1, seen_.nodes[other].links[opposite(d)] = -1;
  };
  cut(11, kUp, 6), cut(11, kDown, 16), cut(11, kLeft, 10);
  EXPECT_THAT(mend_all(), testing::ElementsAre(11, 12, 13));
  cut(11, kRight, 12);
  EXPECT_THAT(mend_all(), testing::IsEmpty());
}

// The row above them may be of another surface, where what is whole and lit as the pattern is there by chance.
TEST_F(MendGroups, HaveOthersOfTheirLineBesideThemWhereOneHoldsThem) {
  constexpr int kAbove = 2;
  darken_all_but({kAbove, 7, 12, 17});
  const Sightings all = seen_;
  const CellClaim unnamed{.status = RegionStatus::kNoCodeword};
  const auto is_mended = [&](RegionStatus status, const CellClaim& left, const CellClaim& right) {
    seen_ = all;
    seen_.claims[kAbove].status = status, seen_.claims[kAbove].grid_fit = GridFit::kLoose;
    seen_.claims[kAbove - 1] = left, seen_.claims[kAbove + 1] = right;
    return std::ranges::count(mend_all(), kAbove) == 1;
  };
  const CellClaim elsewhere{.row = 5, .column = 5, .status = RegionStatus::kDamagedShape, .island = 1};
  EXPECT_FALSE(is_mended(RegionStatus::kNeighboursDisagree, unnamed, unnamed));
  EXPECT_TRUE(is_mended(RegionStatus::kDamagedShape, unnamed, unnamed)) << "its surroundings did not refuse it";
  EXPECT_TRUE(is_mended(RegionStatus::kNeighboursDisagree, elsewhere, unnamed));
  EXPECT_TRUE(is_mended(RegionStatus::kNeighboursDisagree, all.claims[kAbove - 1], unnamed)) << "two hold it";
}

// Those of a row alone do not tell how the grid goes on across it.
TEST_F(MendGroups, LieInNoSingleRow) {
  for (std::int32_t node = 0; node < kCount; ++node) seen_.nodes[node].links[kUp] = seen_.nodes[node].links[kDown] = -1;
  EXPECT_THAT(mend_all(), testing::IsEmpty());
}

TEST_F(MendGroups, AskForMoreOfWhatHasOneBesideIt) {
  darken_all_but({12, 13, 14});
  const Sightings all = seen_;
  print([](double, double y) { return y > 3 ? 0.05 : 1; });
  EXPECT_EQ(mend_all().size(), 3);
  seen_ = all;
  for (const Direction d : {kUp, kDown, kLeft}) {
    seen_.nodes[seen_.nodes[kWorn].links[d]].links[opposite(d)] = -1;
    seen_.nodes[kWorn].links[d] = -1;
  }
  EXPECT_THAT(mend_all(), testing::IsEmpty());
}

// Behind those that stand is no way for what is not of their surface.
TEST_F(MendGroups, MayHaveOtherLightBehindWhatStands) {
  put_other_light_at(0);
  for (const int node : {1, kSide}) {
    seen_.claims[node].status = RegionStatus::kDecoded;
    see(node, true_centre(node / kSide, node % kSide));
  }
  EXPECT_EQ(mend_all().size(), kCount - 3);
}

TEST_F(MendGroups, LieBesideNoBorder) {
  const Sightings all = seen_;
  const Grey8 whole = frame_;
  const auto mended_before = [&](int columns_px) {
    seen_ = all;
    frame_ = whole;
    cut_beyond(columns_px);
    return mend_all().size();
  };
  const float pitch_px = seen_.nodes[kWorn].frame.col(0).norm() * static_cast<float>(pattern_.pitch_px());
  EXPECT_EQ(mended_before(static_cast<int>(1.3F * pitch_px)), 0) << "the border cuts what lies beside the last";
  EXPECT_EQ(mended_before(static_cast<int>(2.5F * pitch_px)), kCount);
}

TEST_F(MendGroups, AreThereThoughOthersLieBesideTheBorder) {
  for (int row = 0; row < kSide; ++row) {
    seen_.nodes[row * kSide + kSide - 2].links[kRight] = -1;
    seen_.nodes[row * kSide + kSide - 1].links[kLeft] = -1;
  }
  darken_all_but({5, 6, 7, 8, 9});
  cut_beyond(20);
  EXPECT_THAT(mend_all(), testing::ElementsAre(5, 6, 7, 8));
}

// The light of another projector is off its lines, all of it.
TEST_F(MendGroups, LieOnTheirLinesHereAndThere) {
  const Sightings all = seen_;
  for (CellClaim& claim : seen_.claims) claim.status = RegionStatus::kOffEpipolarLine;
  EXPECT_THAT(mend_all(), testing::IsEmpty());
  seen_ = all;
  for (CellClaim& claim : seen_.claims) claim.status = RegionStatus::kOffEpipolarLine;
  seen_.claims[3].status = RegionStatus::kDamagedShape;
  EXPECT_EQ(mend_all().size(), kCount);
}

// The rest is dark, and holds nothing.
TEST_F(MendGroups, AreNoFartherOffTheirLinesThanPrintMovesThem) {
  darken_all_but({11, 12, 13});
  const Sightings all = seen_;
  const auto mended_at = [&](float off_px) {
    seen_ = all;
    see(12, true_centre(2, 2) + Eigen::Vector2f(0, off_px));
    return mend_all().size();
  };
  EXPECT_EQ(mended_at(3), 3);
  EXPECT_EQ(mended_at(6), 0);
}

TEST_F(MendGroups, LieWhereTheOthersHaveThem) {
  darken_all_but({11, 12, 13});
  EXPECT_EQ(mended_from(1), 3);
  EXPECT_EQ(mended_from(1.4F), 0);
}

// Out of focus they are found from far off: not all that is found is where the others have it.
TEST_F(MendGroups, LieWhereTheOthersHaveThemOutOfFocusToo) {
  frame_ = simulate(draw_pattern(pattern_), rig_, test::kTilted,
                    {.dark = 12, .lit = 170, .blur_sigma_px = 2.4, .noise_sigma = 1});
  blur_px_ = 1.7F;
  EXPECT_EQ(mended_from(1.3F), kCount);
  EXPECT_EQ(mended_from(1.8F), 0);
}

// As where the surface turns away beneath them: their column is where it was.
TEST_F(MendGroups, AreTiltedAsTheOthersAre) {
  darken_all_but({7, 12, 17});
  const Sightings all = seen_;
  const auto mended_in = [&](float share) {
    seen_ = all;
    const Eigen::Vector2f middle = true_centre(2, 2);
    for (int i = 0; i < kCount; ++i) {
      float& x = seen_.nodes[i].centre_px.x();
      x = middle.x() + share * (x - middle.x());
      seen_.moments[i].x = x;
    }
    return mend_all().size();
  };
  EXPECT_EQ(mended_in(1.01F), 3);
  EXPECT_EQ(mended_in(1.09F), 0);
}

// What their lines are said to be is half a pixel from where the pattern lies.
TEST_F(MendGroups, LieOnTheirLines) {
  const EpipolarGate gate(rig_.cameras[0], rig_.projector, 400, 3200);
  const auto mended_beside_lines = [&](float off_px) {
    for (int i = 0; i < kCount; ++i) {
      const Eigen::Vector2f seen_px = seen_.nodes[i].centre_px + Eigen::Vector2f(0, off_px);
      segments_[i] = gate.prepare(pixel_ray(rig_.cameras[0].lens, seen_px.cast<double>()).direction);
      seen_.claims[i].status = RegionStatus::kDamagedShape;
    }
    return mend_all().size();
  };
  const Sightings all = seen_;
  EXPECT_EQ(mended_beside_lines(0.6F), 0);
  seen_ = all;
  EXPECT_EQ(mended_beside_lines(0.2F), kCount);
}

TEST_F(MendGroups, ShowTheirMiddlesAndMostOfTheirLetters) {
  darken_all_but({11, 12, 13});
  const Grey8 whole = frame_;
  const Sightings all = seen_;
  const auto mended_under = [&](auto&& share) {
    frame_ = whole, seen_ = all;
    print(share);
    return mend_all().size();
  };
  const auto strip = [](double ink, double half_px) {
    return [=](double x, double) { return std::abs(x) < half_px ? ink : 1; };
  };
  EXPECT_EQ(mended_under(strip(1, 0)), 3);
  EXPECT_EQ(mended_under(strip(0.5, 3)), 3) << "print darkens its middle";
  frame_ = whole, seen_ = all;
  const Eigen::Vector2f centre = true_centre(2, 2);
  for (int y = -2; y <= 2; ++y)
    for (int x = -2; x <= 2; ++x)
      frame_.at(static_cast<int>(std::lround(centre.x())) + x, static_cast<int>(std::lround(centre.y())) + y) = 30;
  EXPECT_THAT(mend_all(), testing::IsEmpty()) << "something hides its middle";
  EXPECT_EQ(mended_under([](double, double y) { return y > 1 ? 0.05 : 1; }), 0) << "half of it is missing";
}

TEST_F(MendGroups, AreNotOfAnotherLetter) {
  const Sightings all = seen_;
  // Each is said to be the cell one row on.
  for (CellClaim& claim : seen_.claims) ++claim.row;
  EXPECT_THAT(mend_all(), testing::IsEmpty());
}

// Beyond the edge of the pattern no letter is right.
TEST_F(MendGroups, EndWithThePattern) {
  for (CellClaim& claim : seen_.claims) claim.row = static_cast<std::int16_t>(claim.row - kRow - 1);
  for (int column = 0; column < kSide; ++column) seen_.claims[column] = {.status = RegionStatus::kNoCodeword};
  Disputes disputes(pattern_);
  EXPECT_TRUE(disputes.none_around(seen_, kWorn, kCount));
  seen_.shapes[2].distance = 1;
  for (std::size_t letter = 0; letter < pattern_.options.symbols.size(); ++letter) {
    seen_.shapes[2].letter = static_cast<std::int8_t>(letter);
    EXPECT_FALSE(disputes.none_around(seen_, kWorn, kCount));
  }
  EXPECT_TRUE(disputes.none_around(seen_, kWorn, 1)) << "it is two links away";
}

// An edge along the row leaves whole those whose halves are of one letter. The rest is dark: it would hold them.
TEST_F(MendGroups, AreNotWhatIsLeftOfATornLine) {
  constexpr int kRowOf = kSide / 2;
  darken_all_but({10, 11, 12, 13, 14});
  const Grey8 whole = frame_;
  const Sightings all = seen_;
  const auto mended_with_torn = [&](int torn, RegionStatus status) {
    frame_ = whole, seen_ = all;
    for (int column = 0; column < kSide; ++column) seen_.claims[kRowOf * kSide + column].status = status;
    for (int column = 0; column < torn; ++column) {
      const Eigen::Vector2f centre = true_centre(kRowOf, column);
      for (int y = 1; y <= 9; ++y) {
        for (int x = -9; x <= 9; ++x) {
          std::uint8_t& level =
              frame_.at(static_cast<int>(std::lround(centre.x())) + x, static_cast<int>(std::lround(centre.y())) + y);
          level = level > 90 ? 12 : 170;
        }
      }
    }
    return mend_all().size();
  };
  EXPECT_EQ(mended_with_torn(1, RegionStatus::kNeighboursDisagree), kSide - 1);
  EXPECT_EQ(mended_with_torn(2, RegionStatus::kNeighboursDisagree), 0);
  EXPECT_EQ(mended_with_torn(2, RegionStatus::kDamagedShape), kSide - 2) << "these were not refused for their line";
}

}  // namespace
}  // namespace slsd
