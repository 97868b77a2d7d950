// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/nearest_name.hpp"

#include <algorithm>
#include <vector>

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

namespace slsd {
namespace {

// The definition, without a table.
int plain_distance(std::string_view a, std::string_view b) {
  if (a.empty() || b.empty()) return static_cast<int>(a.size() + b.size());
  const int replaced = plain_distance(a.substr(1), b.substr(1)) + (a[0] == b[0] ? 0 : 1);
  return std::min({replaced, plain_distance(a.substr(1), b) + 1, plain_distance(a, b.substr(1)) + 1});
}

TEST(EditDistance, CountsInsertionsDeletionsAndReplacements) {
  EXPECT_EQ(edit_distance("", ""), 0);
  EXPECT_EQ(edit_distance("", "abc"), 3);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3);
  EXPECT_EQ(edit_distance("symbol_size", "symbol_size_px"), 3);
}

RC_GTEST_PROP(EditDistance, IsThatOfTheDefinition, ()) {
  const auto word = rc::gen::resize(6, rc::gen::container<std::string>(rc::gen::element('a', 'b', 'c')));
  const std::string a = *word;
  const std::string b = *word;
  RC_ASSERT(edit_distance(a, b) == plain_distance(a, b));
}

TEST(NearestName, FindsWhatWasMeant) {
  const std::vector<std::string> names{"symbol_size_px", "spacing_px", "symbols", "seed"};
  EXPECT_EQ(nearest_name("symbol", names), "symbols");
  EXPECT_EQ(nearest_name("symbolsize_px", names), "symbol_size_px");
  EXPECT_EQ(nearest_name("sed", names), "seed");
  EXPECT_EQ(nearest_hint("spacing_pix", names), "; did you mean spacing_px?");
}

TEST(NearestName, FindsTheOnlyNameThatBeginsWithAShortenedWord) {
  const std::vector<std::string> names{"timeout-ms", "texture", "exposure-max-us", "exposure-min-us"};
  EXPECT_EQ(nearest_name("time", names), "timeout-ms");
  EXPECT_EQ(nearest_name("exposure", names), std::nullopt);
  EXPECT_EQ(nearest_name("ti", names), std::nullopt);
}

TEST(NearestName, FindsNothingWhereNothingIsNear) {
  const std::vector<std::string> names{"symbols", "seed"};
  EXPECT_EQ(nearest_name("exposure_us", names), std::nullopt);
  EXPECT_EQ(nearest_name(std::string(100000, 's'), names), std::nullopt);
  EXPECT_EQ(nearest_hint("exposure_us", names), "");
}

}  // namespace
}  // namespace slsd
