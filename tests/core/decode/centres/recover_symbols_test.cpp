// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/recover_symbols.hpp"

#include <cmath>
#include <functional>
#include <optional>

#include <gmock/gmock.h>

#include "tests/core/decode/centres/recovered_plane.hpp"

namespace slsd {
namespace {

using test::kTilted;

class RecoverOneOfMany : public test::RecoveredPlane {};

TEST_F(RecoverOneOfMany, PlacesItWhereItIs) {
  EXPECT_THAT(recover(), testing::Optional(testing::Lt(0.06F)));
  EXPECT_NEAR(seen_.moments[kDegraded].background, 12, 3);
  EXPECT_NEAR(seen_.moments[kDegraded].peak, 170, 6);
  EXPECT_LT(seen_.misfits[kDegraded], 2);
}

TEST_F(RecoverOneOfMany, PlacesItByWhatInkHasLeft) {
  print([](double x, double y) { return std::abs(x - 5 - 0.2 * y) < 1.5 ? 0.3 : 1; });
  EXPECT_THAT(recover(), testing::Optional(testing::Lt(0.3F)));
  EXPECT_GT(seen_.misfits[kDegraded], 1) << "less certain than a whole one";
}

// Ink takes light, and gives none: of what it darkens most is left, where another surface would leave none.
TEST_F(RecoverOneOfMany, PlacesItBesideWhatPrintDarkens) {
  const Grey8 whole = frame_;
  const Sightings all = seen_;
  const auto recovered_under = [&](double ink, std::initializer_list<int> without) {
    frame_ = whole, seen_ = all;
    for (const int other : without) hold_nothing(other);
    print([&](double x, double) { return std::abs(x - 2) < 2 ? ink : 1; });
    return recover();
  };
  EXPECT_THAT(recovered_under(0.5, {}), testing::Optional(testing::Lt(0.3F)));
  EXPECT_THAT(recovered_under(0.5, {kDegraded - 1}), testing::Optional(testing::Lt(0.3F)));
  EXPECT_EQ(recovered_under(0.5, {kDegraded - 1, kDegraded + kSide}), std::nullopt) << "a corner shows its middle";
  EXPECT_EQ(recovered_under(0.1, {}), std::nullopt);
  // Of the middle one column of five is as it was: too little to tell.
  frame_ = whole, seen_ = all;
  print([](double x, double) { return std::abs(x - 1) < 2 ? 0.5 : 1; });
  EXPECT_EQ(recover(), std::nullopt);
}

// What was recovered is evidence for its cell, as a whole symbol is; light beside its letter is evidence for an edge.
TEST_F(RecoverOneOfMany, ShowsItsLetter) {
  const int letter = pattern_.array.at(kRow + kSide / 2, kColumn + kSide / 2);
  seen_.nodes[kDegraded].split = true;
  ASSERT_TRUE(recover().has_value());
  EXPECT_EQ(seen_.aligned[kDegraded], Aligned::kWhole);
  EXPECT_EQ(seen_.shapes[kDegraded].letter, letter);
  EXPECT_GT(seen_.shapes[kDegraded].share_of(letter, 0.2F), 0.9F);
  EXPECT_TRUE(seen_.shapes[kDegraded].is_well_seen());
  EXPECT_FALSE(seen_.nodes[kDegraded].split);
}

TEST_F(RecoverOneOfMany, RestoresTheLinksToThoseThatPutItThere) {
  for (const Direction d : kDirections)
    seen_.nodes[kDegraded].broken[d] = seen_.nodes[seen_.nodes[kDegraded].links[d]].broken[opposite(d)] = true;
  hold_nothing(kDegraded + 1);
  EXPECT_THAT(recover(), testing::Optional(testing::Lt(0.06F)));
  for (const Direction d : kDirections) EXPECT_EQ(seen_.nodes[kDegraded].broken[d], d == kRight) << d;
}

// Too much of it is dark to align it; nothing is lit where its letter is dark.
TEST_F(RecoverOneOfMany, SaysThatPrintMayHaveTornIt) {
  print([](double x, double) { return x < 1 ? 0.1 : 1; });
  const Grey8 printed = frame_;
  EXPECT_EQ(recover(), std::nullopt);
  EXPECT_EQ(seen_.aligned[kDegraded], Aligned::kPrinted);
  seen_.aligned[kDegraded] = Aligned::kNot;
  frame_ = printed;
  const Eigen::Vector2f centre = true_centre(kSide / 2, kSide / 2);
  for (int y = -12; y <= 12; ++y)
    for (int x = -12; x <= -7; ++x)
      frame_.at(static_cast<int>(std::lround(centre.x())) + x, static_cast<int>(std::lround(centre.y())) + y) = 170;
  EXPECT_EQ(recover(), std::nullopt);
  EXPECT_EQ(seen_.aligned[kDegraded], Aligned::kNot) << "another surface lights it";
}

// A surface may turn away where few hold the symbol. Between those on both sides of it, it cannot.
TEST_F(RecoverOneOfMany, IsTiltedMoreBesideFew) {
  const Sightings all = seen_;
  const auto is_recovered = [&](float share, std::initializer_list<int> without) {
    seen_ = all;
    for (const int other : without) hold_nothing(other);
    for (GridNode& node : seen_.nodes) node.frame.col(0) *= share;
    return recover().has_value();
  };
  constexpr float kByLess = 1.04F, kByMore = 1.08F, kByMost = 1.13F;  // .4, .7 and 1.2 px at the middles of its sides
  for (const float share : {kByLess, 1 / kByLess}) EXPECT_TRUE(is_recovered(share, {})) << share;
  for (const float share : {kByMore, 1 / kByMore}) {
    EXPECT_FALSE(is_recovered(share, {})) << share;
    EXPECT_FALSE(is_recovered(share, {kDegraded - 1})) << share;
    EXPECT_TRUE(is_recovered(share, {kDegraded - 1, kDegraded + kSide})) << share;
  }
  for (const float share : {kByMost, 1 / kByMost})
    EXPECT_FALSE(is_recovered(share, {kDegraded - 1, kDegraded + kSide})) << share;
}

TEST_F(RecoverOneOfMany, FollowsDepthAlongTheEpipolarLine) {
  // As if those around lay a pixel farther along it, which runs nearly along the rows.
  for (int i = 0; i < kSide * kSide; ++i) seen_.nodes[i].centre_px.x() += 1;
  EXPECT_THAT(recover(), testing::Optional(testing::Lt(0.06F)));
}

TEST_F(RecoverOneOfMany, LeavesWhatLiesFarAlongTheLine) {
  // From farther off it would not be found at all.
  for (int i = 0; i < kSide * kSide; ++i) seen_.nodes[i].centre_px.x() += 2.2F;
  EXPECT_EQ(recover(), std::nullopt);
}

TEST_F(RecoverOneOfMany, LeavesWhatLiesOnTwoSurfaces) {
  const Grey8 nearer = simulate(draw_pattern(pattern_), rig_, plane({0, 0, 1992}, {0.4, 0.15, -1}),
                                {.dark = 12, .lit = 170, .noise_sigma = 1});
  const Eigen::Vector2f centre = true_centre(kSide / 2, kSide / 2);
  for (int y = -14; y <= 14; ++y) {
    for (int x = 0; x <= 14; ++x) {
      const int u = static_cast<int>(std::lround(centre.x())) + x, v = static_cast<int>(std::lround(centre.y())) + y;
      frame_.at(u, v) = nearer.at(u, v);
    }
  }
  EXPECT_EQ(recover(), std::nullopt);
}

TEST_F(RecoverOneOfMany, LeavesWhatLiesAcrossTheLine) {
  for (int i = 0; i < kSide * kSide; ++i) seen_.nodes[i].centre_px.y() += 1.5F;
  EXPECT_EQ(recover(), std::nullopt);
}

TEST_F(RecoverOneOfMany, LeavesAnotherLetter) {
  const EpipolarGate gate(rig_.cameras[0], rig_.projector, 400, 3200);
  const int own = pattern_.array.at(kRow + kSide / 2, kColumn + kSide / 2);
  for (int column = kSide / 2; column < 22; ++column) {
    if (pattern_.array.at(kRow, column) == own) continue;
    // The degraded one is said to be another cell's, whose neighbours are its own.
    for (int i = 0; i < kSide * kSide; ++i) {
      seen_.claims[i].row = static_cast<std::int16_t>(kRow + i / kSide - kSide / 2);
      seen_.claims[i].column = static_cast<std::int16_t>(column + i % kSide - kSide / 2);
      // On their lines, as if they were seen where those cells are.
      const Eigen::Vector2d square(pattern_.symbol_centre_u_px(seen_.claims[i].column),
                                   pattern_.symbol_centre_v_px(seen_.claims[i].row));
      segments_[i] = gate.prepare(rig_.cameras[0].lens.undistort(*camera_from_projector(square, rig_, kTilted)));
    }
    EXPECT_EQ(recover(), std::nullopt) << column;
  }
}

TEST_F(RecoverOneOfMany, LeavesWhatIsHiddenInItsMiddle) {
  const Eigen::Vector2f centre = true_centre(kSide / 2, kSide / 2);
  for (int y = -2; y <= 2; ++y)
    for (int x = -2; x <= 2; ++x)
      frame_.at(static_cast<int>(std::lround(centre.x())) + x, static_cast<int>(std::lround(centre.y())) + y) = 90;
  EXPECT_EQ(recover(), std::nullopt);
}

// Seven of the 25 pixels around its middle are hidden, and a third of its cell: enough is left where three hold it.
TEST_F(RecoverOneOfMany, ShowsMoreWhereTwoAloneHoldIt) {
  const Eigen::Vector2f centre = true_centre(kSide / 2, kSide / 2);
  const int u = static_cast<int>(std::lround(centre.x())), v = static_cast<int>(std::lround(centre.y()));
  const auto hide = [&](int x, int y) {
    std::uint8_t& level = frame_.at(u + x, v + y);
    level = level > 90 ? 30 : 150;
  };
  for (int y = -2; y <= 2; ++y) hide(2, y);
  hide(1, 1), hide(1, 2);
  const Sightings all = seen_;
  const auto is_recovered_without = [&](std::initializer_list<int> others) {
    seen_ = all;
    for (const int other : others) hold_nothing(other);
    return recover().has_value();
  };
  EXPECT_TRUE(is_recovered_without({kDegraded + 1, kDegraded + kSide})) << "most of the rest is seen";
  for (int y = -13; y <= 13; ++y)
    for (int x = -13; x <= -5; ++x) hide(x, y);
  EXPECT_TRUE(is_recovered_without({}));
  EXPECT_TRUE(is_recovered_without({kDegraded + 1}));
  EXPECT_FALSE(is_recovered_without({kDegraded + 1, kDegraded + kSide}));
}

/// Only neighbours to its right support the degraded symbol, and only those below support a second one there.
class RecoverWhatOneHolds : public RecoverOneOfMany {
 protected:
  static constexpr int kBelow = kDegraded + kSide;
  RecoverWhatOneHolds() {
    for (int i = 0; i < kSide * kSide; ++i)
      if (i % kSide < kSide / 2 || (i / kSide != kSide / 2 && i / kSide != kSide / 2 + 1)) hold_nothing(i);
    hold_nothing(kBelow);
  }
  /// As one that is degraded, too.
  void wear_the_one_below() {
    seen_.claims[kBelow].status = RegionStatus::kDamagedShape;
    seen_.nodes[kBelow].centre_px += Eigen::Vector2f(2, -3);
  }
};

TEST_F(RecoverWhatOneHolds, TakesItWhereTwoInALinePutIt) {
  EXPECT_THAT(recover(), testing::Optional(testing::Lt(0.06F)));
  EXPECT_EQ(seen_.claims[kDegraded].rule, DecodeRule::kRecovered);
}

TEST_F(RecoverWhatOneHolds, TakesTwoBesideEachOther) {
  wear_the_one_below();
  EXPECT_THAT(recover_all(), testing::ElementsAre(kDegraded, kBelow));
  const GreyMoments& below = seen_.moments[kBelow];
  EXPECT_LT((Eigen::Vector2f(below.x, below.y) - true_centre(kSide / 2 + 1, kSide / 2)).norm(), 0.06F);
}

// What two hold may be disturbed more: the limits of one are narrower, each by itself.
TEST_F(RecoverWhatOneHolds, AsksForMoreThanWhereTwoHoldIt) {
  const Grey8 whole = frame_;
  const Sightings all = seen_;
  const auto is_recovered = [&](int supporters, const std::function<void()>& disturb) {
    frame_ = whole, seen_ = all;
    if (supporters == 2) {
      for (const int above : {kDegraded - kSide, kDegraded - 2 * kSide})
        seen_.claims[above].status = RegionStatus::kDecoded;
    }
    disturb();
    return recover().has_value();
  };
  const auto move_all = [&](float x, float y) {
    for (GridNode& node : seen_.nodes) node.centre_px += Eigen::Vector2f(x, y);
  };
  const auto turn_all = [&](float share) {
    for (GridNode& node : seen_.nodes) node.frame.col(0) *= share;
  };
  const auto hide_sixth = [&] {
    const Eigen::Vector2f centre = true_centre(kSide / 2, kSide / 2);
    for (int y = -13; y <= 13; ++y) {
      for (int x = -13; x <= -8; ++x) {
        std::uint8_t& level =
            frame_.at(static_cast<int>(std::lround(centre.x())) + x, static_cast<int>(std::lround(centre.y())) + y);
        level = level > 90 ? 15 : 165;
      }
    }
  };
  const std::vector<std::pair<const char*, std::function<void()>>> disturbances{
      {"along its line", [&] { move_all(0.4F, 0); }},
      {"across its line", [&] { move_all(0, 0.4F); }},
      {"turned", [&] { turn_all(1.04F); }},
      {"hidden", hide_sixth}};
  for (const int supporters : {1, 2}) EXPECT_TRUE(is_recovered(supporters, [] {})) << supporters;
  for (const auto& [what, disturb] : disturbances) {
    EXPECT_TRUE(is_recovered(2, disturb)) << what;
    EXPECT_FALSE(is_recovered(1, disturb)) << what;
  }
}

TEST_F(RecoverOneOfMany, AlignsWhatIsDecodedFarOffItsLine) {
  seen_.claims[kDegraded].status = RegionStatus::kDecoded;
  seen_.nodes[kDegraded].centre_px = true_centre(kSide / 2, kSide / 2) + Eigen::Vector2f(0, 0.8F);
  EXPECT_EQ(recover(), std::nullopt) << "its line is said to pass through it";
  const EpipolarGate gate(rig_.cameras[0], rig_.projector, 400, 3200);
  const Eigen::Vector2d seen_px = seen_.nodes[kDegraded].centre_px.cast<double>();
  segments_[kDegraded] = gate.prepare(pixel_ray(rig_.cameras[0].lens, seen_px).direction);
  EXPECT_THAT(recover(), testing::Optional(testing::Lt(0.3F)));
}

TEST_F(RecoverOneOfMany, LeavesWhatReachesBeyondTheFrame) {
  const Eigen::Vector2f off = true_centre(kSide / 2, kSide / 2) - Eigen::Vector2f(6, 6);
  for (GridNode& node : seen_.nodes) node.centre_px -= off;
  EXPECT_EQ(recover(), std::nullopt);
}

TEST(LetterFields, AreAsThePatternIsAroundEachSymbol) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  const LetterFields letters(pattern.options);
  const Grey8 drawn = draw_pattern(pattern);
  const PatternField whole(drawn.view(), 0.72F);
  for (int column = 3; column < 30; ++column) {
    const Eigen::Vector2f square(pattern.symbol_centre_u_px(column), pattern.symbol_centre_v_px(7));
    const Eigen::Vector2f middle = letters.middle_px(pattern.array.at(7, column));
    for (float y = -6.5F; y <= 6.5F; ++y) {
      for (float x = -6.5F; x <= 6.5F; ++x) {
        const float expected = whole.at(square.x() + x, square.y() + y).value;
        EXPECT_NEAR(letters.at(0.7F).at(middle.x() + x, middle.y() + y).value, expected, 0.01);
      }
    }
  }
}

}  // namespace
}  // namespace slsd
