// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/base64.hpp"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

namespace slsd {
namespace {

TEST(ToBase64, FillsUpTheLastGroup) {
  EXPECT_EQ(to_base64(""), "");
  EXPECT_EQ(to_base64("f"), "Zg==");
  EXPECT_EQ(to_base64("fo"), "Zm8=");
  EXPECT_EQ(to_base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(to_base64("\xff\xfe\xfb"), "//77");
}

TEST(FromBase64, RefusesWhatIsNone) {
  for (const char* text : {"Z", "Zg", "Zg=", "Zh==", "Zg==Zg==", "Z g=", "=", "====", "Zm9v\n"})
    EXPECT_EQ(from_base64(text), std::nullopt) << text;
}

RC_GTEST_PROP(FromBase64, GivesTheBytesBack, (const std::string& bytes)) {
  RC_ASSERT(from_base64(to_base64(bytes)) == bytes);
}

RC_GTEST_PROP(FromBase64, TakesAnyText, (const std::string& text)) {
  const auto bytes = from_base64(text);
  if (bytes) RC_ASSERT(to_base64(*bytes) == text);
}

}  // namespace
}  // namespace slsd
