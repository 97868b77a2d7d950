// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/fault.hpp"

#include <chrono>
#include <string>

#include <gmock/gmock.h>

namespace slsd {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

TEST(ParseFault, ReadsEachKind) {
  EXPECT_EQ(parse_fault("drop@3"), (Fault{FaultKind::kDrop, 3, {}}));
  EXPECT_EQ(parse_fault("tear@1"), (Fault{FaultKind::kTear, 1, {}}));
  EXPECT_EQ(parse_fault("late@5:200ms"), (Fault{FaultKind::kLate, 5, 200ms}));
  EXPECT_EQ(parse_fault("late@5"), (Fault{FaultKind::kLate, 5, {}}));
  EXPECT_EQ(parse_fault("stale@18446744073709551615:20us"), (Fault{FaultKind::kStale, ~std::uint64_t{0}, 20us}));
  EXPECT_EQ(parse_fault("hang@3"), (Fault{FaultKind::kHang, 3, std::nullopt}));
  EXPECT_EQ(parse_fault("stall@2:0s"), (Fault{FaultKind::kStall, 2, 0s}));
  EXPECT_EQ(parse_fault("disconnect@7:1.5s"), (Fault{FaultKind::kDisconnect, 7, 1500ms}));
}

TEST(ParseFault, NamesWhatIsWrong) {
  const auto message = [](const char* text) {
    const auto fault = parse_fault(text);
    return fault ? "accepted" : fault.error().message;
  };
  EXPECT_THAT(message(""), HasSubstr("KIND@CAPTURE"));
  EXPECT_THAT(message("drop"), HasSubstr("\"drop\""));
  EXPECT_THAT(message("explode@1"), HasSubstr("the kinds are"));
  for (const char* text : {"drop@", "drop@0", "drop@-1", "drop@1x", "drop@ 1", "drop@18446744073709551616"})
    EXPECT_THAT(message(text), HasSubstr("whole number")) << text;
  for (const char* text : {"late@1:", "late@1:5", "late@1:ms", "late@1:5m", "late@1:-5ms", "late@1:nanms",
                           "late@1:infs", "late@1:3601s", "late@1:5ms:5ms"})
    EXPECT_THAT(message(text), HasSubstr("duration is")) << text;
  EXPECT_THAT(message("drop@1:5ms"), HasSubstr("no duration"));
}

TEST(ParseFaults, ReadsAListAndNamesTheBadEntry) {
  EXPECT_THAT(*parse_faults({}), ::testing::IsEmpty());
  EXPECT_THAT(*parse_faults({"drop@3", "tear@4"}), ::testing::SizeIs(2));
  const auto bad = parse_faults({"drop@3", "tore@4"});
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(bad.error().message, HasSubstr("\"tore@4\""));
}

}  // namespace
}  // namespace slsd
