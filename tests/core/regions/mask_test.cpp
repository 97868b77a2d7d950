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

}  // namespace
}  // namespace slsd
