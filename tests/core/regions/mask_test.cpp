// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/regions/mask.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/core/decode/images.hpp"

namespace slsd {
namespace {

RC_GTEST_PROP(Mask, HoldsWhatTheImageShows, ()) {
  Grey8 image(*rc::gen::inRange(1, 200), *rc::gen::inRange(1, 4));
  for (std::size_t i = 0; i < image.size(); ++i) image.data()[i] = *rc::gen::arbitrary<bool>() ? 255 : 0;
  RC_ASSERT(grey_of(Mask(image.view())) == image);
}

TEST(Mask, IsDarkBeyondTheLastColumn) {
  const Mask mask(Grey8(3, 1, 255).view());
  EXPECT_EQ(*mask.row(0), 0b111U);
}

TEST(Mask, FollowsTheStrideOfAView) {
  const Grey8 image = ascii_mask({"#.##",  //
                                  ".#.#"});
  EXPECT_EQ(Mask(ImageView<std::uint8_t>{image.data() + 1, 3, 2, 4}),
            Mask(ascii_mask({".##",  //
                             "#.#"})
                     .view()));
}

TEST(Mask, OfAnotherSizeIsAnother) {
  EXPECT_NE(Mask(2, 6), Mask(3, 4));
  EXPECT_EQ(Mask(2, 6), Mask(2, 6));
}

RC_GTEST_PROP(Mask, KeepsTheRectangle, ()) {
  Grey8 image(*rc::gen::inRange(1, 200), *rc::gen::inRange(1, 6));
  for (std::size_t i = 0; i < image.size(); ++i) image.data()[i] = *rc::gen::arbitrary<bool>() ? 255 : 0;
  const int left = *rc::gen::inRange(0, image.width() + 1), right = *rc::gen::inRange(0, image.width() + 1);
  const int top = *rc::gen::inRange(0, image.height() + 1), bottom = *rc::gen::inRange(0, image.height() + 1);
  Mask mask(image.view());
  mask.keep(left, top, right, bottom);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const bool inside = x >= left && x < right && y >= top && y < bottom;
      if (!inside) image.data()[static_cast<std::size_t>(y) * image.width() + x] = 0;
    }
  }
  RC_ASSERT(mask == Mask(image.view()));
}

}  // namespace
}  // namespace slsd
