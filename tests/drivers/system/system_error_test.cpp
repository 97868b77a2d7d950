// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/system/system_error.hpp"

#include <cerrno>

#include <gtest/gtest.h>

namespace slsd {
namespace {

constexpr SystemErrorMeaning kKnown[] = {
    {ENOENT, ErrorCode::kDisconnected, "plug it in"},
    {0, ErrorCode::kUnsupported, "buy another"},
};

TEST(SystemError, TellsWhatWhyAndWhatToDo) {
  const Error error = system_error(ENOENT, "cannot read", "a/b");
  EXPECT_EQ(error.code, ErrorCode::kNotFound);
  EXPECT_EQ(to_string(error), "a/b: cannot read: No such file or directory; check the path");
}

TEST(SystemError, GoesByWhatThePlaceKnowsFirst) {
  EXPECT_EQ(system_error(ENOENT, "cannot open", "", kKnown).code, ErrorCode::kDisconnected);
  EXPECT_EQ(system_error(EMFILE, "cannot open", "", kKnown).code, ErrorCode::kNoSpace);
  EXPECT_EQ(system_error(EILSEQ, "cannot open", "", kKnown).code, ErrorCode::kUnsupported);
}

TEST(SystemError, KnowsNoOtherThanAsInputAndOutput) {
  EXPECT_EQ(system_error(EILSEQ, "cannot read").code, ErrorCode::kIo);
}

}  // namespace
}  // namespace slsd
