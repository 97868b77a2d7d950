// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/print/paper.hpp"

#include <gmock/gmock.h>

namespace slsd {
namespace {

using ::testing::HasSubstr;

TEST(ParsePaper, ReadsNamesAndSizes) {
  EXPECT_EQ(*parse_paper("A4"), (Paper{"A4", 297, 210}));
  EXPECT_EQ(*parse_paper("a0"), (Paper{"A0", 1189, 841}));
  EXPECT_EQ(*parse_paper("Letter"), (Paper{"letter", 279.4, 215.9}));
  EXPECT_EQ(*parse_paper("700x500.5"), (Paper{"700x500.5 mm", 700, 500.5}));
}

TEST(ParsePaper, SaysWhatThereIs) {
  for (const char* text :
       {"", "A9", "A", "297", "297x", "x210", "297x0", "297x-3", "nanxnan", "1e9x1e9", "210x297x3"}) {
    const auto paper = parse_paper(text);
    ASSERT_FALSE(paper) << text;
    EXPECT_EQ(paper.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(paper.error().message, HasSubstr("WIDTHxHEIGHT"));
  }
}

}  // namespace
}  // namespace slsd
