// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/pixels/pixel_judge.hpp"

#include <gtest/gtest.h>

namespace slsd {
namespace {

TEST(EvidenceTable, LightWhereItShouldBeSpeaksForTheSurface) {
  const Evidence lit = EvidenceTable::reckon(1, 0.95F, 0, 0.02F);
  EXPECT_GT(lit.against_another, 0.3);
  EXPECT_GT(lit.against_unlit, 2);
}

TEST(EvidenceTable, DarkWhereItShouldBeDarkTellsNothingOfShadow) {
  const Evidence dark = EvidenceTable::reckon(0, 0, 0, 0.02F);
  EXPECT_GT(dark.against_another, 0.3);
  EXPECT_NEAR(dark.against_unlit, 0, 0.05);
}

TEST(EvidenceTable, WhatShouldNotBeSpeaksAgainst) {
  EXPECT_LT(EvidenceTable::reckon(1, 0, 0, 0.02F).against_unlit, -2);
  EXPECT_LT(EvidenceTable::reckon(1, 0, 0, 0.02F).against_another, -1.5);
  EXPECT_LT(EvidenceTable::reckon(0, 1, 0, 0.02F).against_another, -1);
}

TEST(EvidenceTable, NoiseMakesEverythingLessSure) {
  const auto against = [](float noise) { return EvidenceTable::reckon(1, 0, 0, noise).against_unlit; };
  EXPECT_GT(against(0.32F), against(0.02F) + 1);
}

TEST(EvidenceTable, AtAnEdgeOfTheLightAPixelMayBeEither) {
  const Evidence steep = EvidenceTable::reckon(0.5F, 0.6F, 0.3F, 0.02F);
  EXPECT_GT(steep.against_another, EvidenceTable::reckon(0.5F, 0.6F, 0, 0.02F).against_another - 1);
  EXPECT_GT(EvidenceTable::reckon(0.5F, 0.7F, 0.3F, 0.02F).against_another,
            EvidenceTable::reckon(0.5F, 0.7F, 0, 0.02F).against_another);
}

TEST(EvidenceTable, SaturatedPixelMayBeAnyBrighter) {
  const auto reckon = [](float expected, float full) { return EvidenceTable::reckon(expected, full, 0, 0.02F, true); };
  EXPECT_GT(reckon(1, 0.5F).against_another, 0.5);
  EXPECT_GT(reckon(1, 0.5F).against_unlit, 2);
  EXPECT_NEAR(reckon(1, 0.5F).against_another, reckon(0.8F, 0.5F).against_another, 0.05);
  EXPECT_LT(reckon(0, 0.5F).against_another, -1.5);
}

TEST(EvidenceTable, TableIsWhatIsReckoned) {
  const EvidenceTable table;
  for (const float expected : {0.F, 0.25F, 0.5F, 1.F}) {
    for (const float seen : {-0.1F, 0.F, 0.5F, 1.F, 1.3F}) {
      for (const float noise : {0.01F, 0.04F, 0.16F}) {
        for (const bool saturated : {false, true}) {
          SCOPED_TRACE(testing::Message() << expected << " " << seen << " " << noise << " " << saturated);
          const Evidence wanted = EvidenceTable::reckon(expected, seen, 0.2F, noise, saturated);
          const Evidence got = table.at(expected, seen, 0.2F, noise, saturated);
          EXPECT_NEAR(got.against_another, wanted.against_another, 0.01);
          EXPECT_NEAR(got.against_unlit, wanted.against_unlit, 0.01);
        }
      }
    }
  }
}

TEST(EvidenceTable, FarOffItsAxesItsEndsStand) {
  const EvidenceTable table;
  EXPECT_EQ(table.at(2, 9, 9, 9).against_unlit, table.at(1, 1.85F, 0.3F, 0.32F).against_unlit);
  EXPECT_EQ(table.at(-1, -9, 0, 0).against_unlit, table.at(0, -0.5F, 0, 0.01F).against_unlit);
}

}  // namespace
}  // namespace slsd
