// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <optional>
#include <utility>

#include <gtest/gtest.h>

#include "tests/adversary/margin_table.hpp"
#include "tests/adversary/misled.hpp"
#include "tests/adversary/rule_sweep.hpp"

namespace slsd::adversary {
namespace {

class Trial : public testing::Test {
 protected:
  void SetUp() override {
    auto misled = Misled::of(16, &trial_);
    ASSERT_TRUE(misled);
    misled_.emplace(std::move(*misled));
  }
  const Decoding& decode(Kind kind) {
    const Frame frame = misled_->maker.make(kind, 0);
    const auto decoding = misled_->decoders[0].decode(frame.image.view(), 255);
    EXPECT_TRUE(decoding);
    return **decoding;
  }

  RuleTrial trial_;
  std::optional<Misled> misled_;
};

TEST_F(Trial, EveryRegionHasTheStatusThatItsRuleGives) {
  for (int kind = 0; kind < kKinds; ++kind) {
    const Decoding& decoding = decode(static_cast<Kind>(kind));
    std::size_t decided = 0;
    for (const RegionSeen& region : decoding.regions) {
      EXPECT_EQ(region.status, text_of(region.rule).gives) << to_string(region.rule);
      EXPECT_NE(text_of(region.rule).kind, RuleKind::kGuards) << to_string(region.rule);
      const RuleKind guard = region.guard ? text_of(*region.guard).kind : RuleKind::kGuards;
      EXPECT_EQ(guard, RuleKind::kGuards);
    }
    for (std::size_t i = 0; i < kDecodeRuleCount; ++i)
      if (text_of(decode_rule(i)).kind != RuleKind::kGuards) decided += decoding.rules[i];
    EXPECT_EQ(decided, decoding.regions.size());
  }
}

TEST_F(Trial, LeavesARuleOutAndTakesItBack) {
  constexpr auto kIndex = static_cast<std::size_t>(DecodeRule::kTouchesBorder);
  const RuleCounts before = decode(Kind::kShelves).rules;
  EXPECT_GT(before[kIndex], 0U);
  trial_.off.set(kIndex);
  EXPECT_EQ(decode(Kind::kShelves).rules[kIndex], 0U);
  trial_.off.reset();
  EXPECT_EQ(decode(Kind::kShelves).rules, before);
}

TEST_F(Trial, WholeMarginsDecideAlike) {
  const Decoding before = decode(Kind::kPickets);
  trial_.whole_margins = true;
  const Decoding& whole = decode(Kind::kPickets);
  EXPECT_EQ(whole.points, before.points);
  float most = 0, most_before = 0;
  for (std::size_t i = 0; i < whole.regions.size(); ++i) {
    EXPECT_EQ(whole.regions[i].rule, before.regions[i].rule);
    EXPECT_GE(whole.regions[i].margin_nats, before.regions[i].margin_nats - 1e-3F);
    most = std::max(most, whole.regions[i].margin_nats);
    most_before = std::max(most_before, before.regions[i].margin_nats);
  }
  EXPECT_GT(most, most_before + 1);
}

TEST(Margins, SayHowManyCellsAreWrong) {
  RuleTrial trial;
  trial.whole_margins = true;
  constexpr double kNearlyAll = 0.5;
  Misled misled = Misled::of(8, &trial, kNearlyAll).value();
  MarginTable table;
  for (int kind = 0; kind < kKinds; ++kind) {
    for (std::uint32_t number = 500; number < 504; ++number) {
      const Frame frame = misled.maker.make(static_cast<Kind>(kind), number);
      const auto decoding = misled.decoders[number % 3].decode(frame.image.view(), 255);
      ASSERT_TRUE(decoding);
      table.add(**decoding, misled.maker.judge(frame, (*decoding)->points, kTolerancePx).wrong_points);
    }
  }
  double expected = 0, wrong = 0;
  constexpr int kFirstNat = 3;  // below, more are wrong than the model says
  for (int nat = kFirstNat; nat < MarginTable::kNats; ++nat)
    expected += table.at(nat).expected, wrong += table.at(nat).wrong;
  EXPECT_GT(expected, 5);
  EXPECT_LT(wrong, 3 * expected);
  EXPECT_GT(wrong, expected / 3);
}

TEST_F(Trial, ARuleThatWasNotMetChangesNothing) {
  const RuleCounts all = decode(Kind::kShelves).rules;
  RuleSet met;
  for (std::size_t i = 0; i < kDecodeRuleCount; ++i) met[i] = trial_.met[i];
  EXPECT_TRUE(met.any());
  trial_.off = ~met;
  EXPECT_EQ(decode(Kind::kShelves).rules, all);
}

TEST(RuleNames, OfRulesWithASwitchAreKnown) {
  EXPECT_EQ(*rule_named("cell_twice"), DecodeRule::kCellTwice);
  EXPECT_FALSE(rule_named("no_window")) << "nothing names a cell then";
  EXPECT_EQ(rule_named("nonsense").error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace slsd::adversary
