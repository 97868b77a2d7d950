// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/board_request.hpp"

#include <gmock/gmock.h>

#include "core/print/sheet.hpp"

namespace slsd {
namespace {

TEST(RequestedBoard, IsWithoutAWordTheOneThatIsPrintedWithoutAWord) {
  const auto paper = parse_paper("A4");
  ASSERT_TRUE(paper);
  const auto printed = board_for(*paper);
  const auto expected = requested_board({});
  ASSERT_TRUE(printed && expected);
  EXPECT_EQ(to_string(*printed), to_string(*expected));
  EXPECT_EQ(*printed, *expected);
}

}  // namespace
}  // namespace slsd
