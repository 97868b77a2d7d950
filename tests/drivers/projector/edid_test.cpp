// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/x11/edid.hpp"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include "tests/doubles/x11/desktop.hpp"

namespace slsd {
namespace {

using test::edid_with;

TEST(ReadEdid, PrefersTextsToNumbers) {
  const auto identity = read_edid(edid_with("Beamer 3", "PJ-4711"));
  EXPECT_EQ(identity.model, "Beamer 3");
  EXPECT_EQ(identity.serial, "PJ-4711");
}

TEST(ReadEdid, FallsBackToNumbers) {
  auto bytes = edid_with("", "");
  EXPECT_EQ(read_edid(bytes).model, "CBA 1234");
  EXPECT_EQ(read_edid(bytes).serial, "");
  bytes[12] = 0x01;
  bytes[15] = 0x80;
  EXPECT_EQ(read_edid(bytes).serial, "2147483649");
}

TEST(ReadEdid, KnowsNothingOfWhatIsNone) {
  for (const auto& bytes : {std::vector<std::uint8_t>{}, std::vector<std::uint8_t>(128), std::vector<std::uint8_t>(64)})
    EXPECT_EQ(read_edid(bytes).model + read_edid(bytes).serial, "");
}

RC_GTEST_PROP(ReadEdid, TakesAnyBytes, (std::vector<std::uint8_t> noise)) {
  auto bytes = edid_with("Beamer", "1");
  for (std::size_t i = 0; i < noise.size(); ++i) bytes[8 + i % 120] = noise[i];
  const auto identity = read_edid(bytes);
  RC_ASSERT(identity.model.size() <= 13U && identity.serial.size() <= 13U);
}

}  // namespace
}  // namespace slsd
