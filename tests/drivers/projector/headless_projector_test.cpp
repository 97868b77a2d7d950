// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/headless_projector.hpp"
#include "tests/drivers/projector/soon.hpp"

#include <chrono>
#include <cmath>

#include <gmock/gmock.h>

namespace slsd {
namespace {

using test::soon;

using namespace std::chrono_literals;

HeadlessProjectorOptions small() {
  return {.width_px = 16, .height_px = 9, .refresh_hz = 200.0};
}

TEST(HeadlessProjector, ShowsOnlyAtItsRefreshes) {
  HeadlessProjector projector(small());
  ASSERT_TRUE(projector.open(soon()));
  const MonotonicTime first = *projector.show(Grey8(16, 9), soon());
  for (int i = 0; i < 5; ++i) EXPECT_EQ((*projector.show(Grey8(16, 9), soon()) - first) % 5ms, 0ns);
}

TEST(HeadlessProjector, IsGoneFromWhenItIsUnpluggedUntilItIsOpened) {
  HeadlessProjector projector(small());
  ASSERT_TRUE(projector.open(soon()));
  projector.disconnect();
  EXPECT_EQ(projector.show(Grey8(16, 9), soon()).error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(projector.read_back().error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(projector.check(soon()).error().code, ErrorCode::kDisconnected);
  ASSERT_TRUE(projector.open(soon()));
  EXPECT_TRUE(projector.show(Grey8(16, 9), soon()));
}

TEST(HeadlessProjector, IsUnpluggedAtTheCallsThatItIsToldTo) {
  HeadlessProjectorOptions options = small();
  options.disconnect_at = {2};
  HeadlessProjector projector(options);
  ASSERT_TRUE(projector.open(soon()));
  EXPECT_TRUE(projector.show(Grey8(16, 9, 7), soon()));
  EXPECT_EQ(projector.show(Grey8(16, 9), soon()).error().code, ErrorCode::kDisconnected);
  ASSERT_TRUE(projector.open(soon()));
  EXPECT_EQ(projector.read_back(), Grey8(16, 9, 0));
  EXPECT_TRUE(projector.show(Grey8(16, 9), soon()));
}

TEST(HeadlessProjector, NamesTheKeyThatIsOutOfRange) {
  const auto where = [](HeadlessProjectorOptions options) {
    const auto opened = HeadlessProjector(options).open(soon());
    return opened ? "valid" : opened.error().where;
  };
  EXPECT_EQ(where(small()), "valid");
  EXPECT_EQ(where({.width_px = 0}), "width_px");
  EXPECT_EQ(where({.height_px = 20000}), "height_px");
  EXPECT_EQ(where({.refresh_hz = std::nan("")}), "refresh_hz");
}

}  // namespace
}  // namespace slsd
