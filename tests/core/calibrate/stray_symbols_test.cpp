// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/watch/stray_symbols.hpp"

#include <gmock/gmock.h>

namespace slsd {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

Decoding decoded(std::size_t points, std::size_t off_line) {
  Decoding decoding;
  decoding.points.resize(points);
  for (std::size_t i = 0; i < off_line; ++i) {
    SymbolMatch& match = decoding.off_line.emplace_back();
    match.camera_px << 10.5, 20;
    match.projector_px << 30, 40.25;
  }
  return decoding;
}

TEST(StraySymbols, OutnumberThePoints) {
  EXPECT_THAT(stray_symbols(decoded(100, 100), 1), SizeIs(100));
  EXPECT_THAT(stray_symbols(decoded(101, 100), 1), IsEmpty());
}

TEST(StraySymbols, AreNoneIfFew) {
  EXPECT_THAT(stray_symbols(decoded(0, 24), 1), SizeIs(24));
  EXPECT_THAT(stray_symbols(decoded(0, 23), 1), IsEmpty());
}

TEST(StraySymbols, KeepTheirPixelsAndCamera) {
  const CloudPoint stray = stray_symbols(decoded(0, 24), 3).back();
  EXPECT_EQ(stray.camera_u, 10.5F);
  EXPECT_EQ(stray.camera_v, 20);
  EXPECT_EQ(stray.projector_u, 30);
  EXPECT_EQ(stray.projector_v, 40.25F);
  EXPECT_EQ(stray.camera, 3);
}

}  // namespace
}  // namespace slsd
