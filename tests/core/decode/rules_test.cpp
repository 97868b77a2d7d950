// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/rules.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/decode/grid/cell_claim.hpp"
#include "docs/tables/reason_table.hpp"

namespace slsd {
namespace {

std::string text_of_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(Rules, HaveANameASentenceAndARemedyEach) {
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < kDecodeRuleCount; ++i) {
    const RuleText& text = text_of(decode_rule(i));
    EXPECT_TRUE(names.insert(text.name).second) << text.name;
    EXPECT_TRUE(std::regex_match(std::string(text.name), std::regex("[a-z]+(_[a-z]+)*"))) << text.name;
    EXPECT_LE(std::ranges::count(text.meaning, ' '), 24) << text.meaning;
    EXPECT_TRUE(text.meaning.ends_with('.')) << text.name;
    EXPECT_EQ(text.remedy.empty(), text.kind == RuleKind::kAccepts) << text.name;
    EXPECT_EQ(text.gives == RegionStatus::kDecoded, text.kind != RuleKind::kRejects) << text.name;
  }
}

// Two windows that name different cells are weighed against each other: nothing is ambiguous any more.
TEST(Rules, GiveEveryStatusButOne) {
  std::set<RegionStatus> given;
  for (std::size_t i = 0; i < kDecodeRuleCount; ++i) given.insert(text_of(decode_rule(i)).gives);
  EXPECT_EQ(given.size(), kRegionStatusCount - 1);
  EXPECT_FALSE(given.contains(RegionStatus::kAmbiguousCodeword));
}

TEST(Rules, DecideOnAClaim) {
  CellClaim claim;
  claim.decide(DecodeRule::kSplit);
  EXPECT_EQ(claim.status, RegionStatus::kDamagedShape);
  EXPECT_EQ(claim.rule, DecodeRule::kSplit);
  claim.decide(DecodeRule::kRecovered);
  EXPECT_EQ(claim.status, RegionStatus::kDecoded);
}

TEST(Rules, GuardsAreKeptWhereTheyHold) {
  CellClaim claim;
  EXPECT_TRUE(claim.pass(Rules(), DecodeRule::kRecoverTilted, true));
  EXPECT_EQ(claim.guard, DecodeRule::kCertain);
  EXPECT_FALSE(claim.pass(Rules(), DecodeRule::kRecoverTilted, false));
  EXPECT_EQ(claim.guard, DecodeRule::kRecoverTilted);
}

TEST(Rules, ThatAreLeftOutDoNotApplyButWereMet) {
  RuleTrial trial;
  const Rules rules(&trial);
  EXPECT_TRUE(rules.apply(DecodeRule::kSplit, true));
  trial.off.set(static_cast<std::size_t>(DecodeRule::kSplit));
  trial.forget();
  EXPECT_FALSE(rules.apply(DecodeRule::kSplit, false));
  EXPECT_FALSE(trial.met[static_cast<std::size_t>(DecodeRule::kSplit)]);
  EXPECT_FALSE(rules.apply(DecodeRule::kSplit, true));
  EXPECT_TRUE(trial.met[static_cast<std::size_t>(DecodeRule::kSplit)]);
  CellClaim claim;
  trial.off.set(static_cast<std::size_t>(DecodeRule::kRecoverMoved));
  EXPECT_TRUE(claim.pass(rules, DecodeRule::kRecoverMoved, false));
  EXPECT_EQ(claim.guard, DecodeRule::kCertain);
}

// What a status says and the rule that a picture shows could part otherwise.
TEST(Rules, AloneWriteAStatus) {
  const std::regex writes(R"((claim|claims\[[^=;]*\]|other|adopted)\.status = )");
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(SLSD_SOURCE_DIR "/core/decode")) {
    if (!entry.is_regular_file()) continue;
    EXPECT_FALSE(std::regex_search(text_of_file(entry.path()), writes)) << entry.path() << ": call decide()";
    ++files;
  }
  EXPECT_GT(files, 50);
}

TEST(Rules, AreInTheDocumentation) {
  EXPECT_EQ(text_of_file(SLSD_SOURCE_DIR "/docs/reasons.md"), reason_document()) << "write it anew: ./run tables";
}

}  // namespace
}  // namespace slsd
