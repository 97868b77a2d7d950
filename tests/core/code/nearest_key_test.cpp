// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/nearest_key.hpp"

#include <array>

#include <gtest/gtest.h>

namespace slsd {
namespace {

constexpr std::array<std::string_view, 3> kKnown = {"symbol_size_px", "spacing_px", "seed"};

TEST(NearestKey, FindsTheKeyThatWasMeant) {
  EXPECT_EQ(nearest_key("symbol_size", kKnown), "symbol_size_px");
  EXPECT_EQ(nearest_key("spacin_px", kKnown), "spacing_px");
  EXPECT_EQ(nearest_key("seeds", kKnown), "seed");
  EXPECT_EQ(nearest_key("ssed", kKnown), "seed");
}

TEST(NearestKey, AnswersForAnyKey) {
  EXPECT_EQ(nearest_key("", kKnown), "seed");
  EXPECT_EQ(nearest_key(std::string(100000, 'x'), kKnown), nearest_key(std::string(64, 'x'), kKnown));
}

}  // namespace
}  // namespace slsd
