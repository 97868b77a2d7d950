// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/grey_moments.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include "core/regions/find_regions.hpp"
#include "tests/core/decode/images.hpp"

namespace slsd {
namespace {

constexpr int kMarginPx = 2;
constexpr double kDark = 20, kLit = 180;

double rising_edge(double x) {
  return 0.5 * std::erfc(-x / std::sqrt(2.));  // blurred with a sigma of one pixel
}

struct Box {
  double left, top, right, bottom;
};

/// A box of light through a lens that blurs, brighter by the shading for each pixel to the right of its middle.
Grey8 blurred_box(const Box& box, double noise_sigma = 0, double shading = 0) {
  Grey8 frame(48, 40);
  std::mt19937 random(11);
  std::normal_distribution<double> noise(0, 1);
  for (int y = 0; y < frame.height(); ++y) {
    for (int x = 0; x < frame.width(); ++x) {
      const double light = (rising_edge(x - box.left) - rising_edge(x - box.right)) *
                           (rising_edge(y - box.top) - rising_edge(y - box.bottom)) *
                           (1 + shading * (x - 0.5 * (box.left + box.right)));
      const double grey = kDark + (kLit - kDark) * light + noise_sigma * noise(random);
      frame.at(x, y) = static_cast<std::uint8_t>(std::clamp(std::lround(grey), 0L, 255L));
    }
  }
  return frame;
}

Regions regions_above(const Grey8& frame, int threshold = 70) {
  Grey8 mask(frame.width(), frame.height());
  for (std::size_t i = 0; i < mask.size(); ++i) mask.data()[i] = frame.data()[i] > threshold ? 255 : 0;
  Regions found;
  RegionFinder().find(Mask(mask.view()), found);
  return found;
}

GreyMoments measure(const Grey8& frame, const Regions& regions, std::size_t index = 0) {
  const Region& region = regions.regions[index];
  return GreyMomentMeter(kMarginPx).measure(frame.view(), region, regions.runs_of(region), SteadyCentre::kMeasured);
}

struct Pixel {
  double x, y, grey;
};

// The region and its margin: in each row from the leftmost to the rightmost that a run nearby reaches.
std::vector<Pixel> pixels_around(const Grey8& frame, std::span<const Run> runs) {
  std::vector<Pixel> pixels;
  for (int y = 0; y < frame.height(); ++y) {
    int left = frame.width(), right = -1;
    for (const Run& run : runs) {
      if (std::abs(run.row - y) > kMarginPx) continue;
      left = std::min(left, run.left - kMarginPx);
      right = std::max(right, run.right - 1 + kMarginPx);
    }
    for (int x = std::max(left, 0); x <= std::min(right, frame.width() - 1); ++x)
      pixels.push_back({static_cast<double>(x), static_cast<double>(y), static_cast<double>(frame.at(x, y))});
  }
  return pixels;
}

struct PlainMoments {
  double steady_x = 0, steady_y = 0;
  double x = 0, y = 0, weight = 0, background = 0, peak = 0;
  double m20 = 0, m11 = 0, m02 = 0, m30 = 0, m21 = 0, m12 = 0, m03 = 0;
};

// The same moments by their definition: levels, ramp, centroid first, then the sums about it.
PlainMoments plain_moments(const std::vector<Pixel>& pixels) {
  double low = std::numeric_limits<double>::max(), high = 0;
  for (const Pixel& p : pixels) low = std::min(low, p.grey), high = std::max(high, p.grey);
  double low_sum = 0, high_sum = 0, low_count = 0, high_count = 0;
  for (const Pixel& p : pixels) {
    if (p.grey <= low + 0.25 * (high - low)) low_sum += p.grey, ++low_count;
    if (p.grey >= high - 0.25 * (high - low)) high_sum += p.grey, ++high_count;
  }
  PlainMoments m;
  m.background = low_sum / low_count, m.peak = high_sum / high_count;
  const auto weight = [&](const Pixel& p) {
    return std::clamp(((p.grey - m.background) / (m.peak - m.background) - 0.1) / 0.2, 0., 1.);
  };
  double shape_x = 0, shape_y = 0, centre = 0, steady = 0;
  for (const Pixel& p : pixels) m.weight += weight(p), shape_x += weight(p) * p.x, shape_y += weight(p) * p.y;
  shape_x /= m.weight, shape_y /= m.weight;
  for (const Pixel& p : pixels) {
    const double above = ((p.grey - m.background) / (m.peak - m.background) - 0.2);
    const double c = std::clamp(above / 0.6, 0., 1.), s = std::clamp(above / 0.45, 0., 1.);
    centre += c, m.x += c * p.x, m.y += c * p.y;
    steady += s, m.steady_x += s * p.x, m.steady_y += s * p.y;
  }
  m.x /= centre, m.y /= centre;
  m.steady_x /= steady, m.steady_y /= steady;
  for (const Pixel& p : pixels) {
    const double w = weight(p) / m.weight, x = p.x - shape_x, y = p.y - shape_y;
    m.m20 += w * x * x, m.m11 += w * x * y, m.m02 += w * y * y;
    m.m30 += w * x * x * x, m.m21 += w * x * x * y, m.m12 += w * x * y * y, m.m03 += w * y * y * y;
  }
  return m;
}

// A blob of random grey values, at the frame's border as often as inside it.
Grey8 random_blob(std::mt19937& random, int left, int top) {
  Grey8 frame(48, 40, 15);
  for (int spot = 0; spot < 5; ++spot) {
    const int cx = left + static_cast<int>(random() % 10), cy = top + static_cast<int>(random() % 10),
              radius = 2 + static_cast<int>(random() % 4);
    for (int y = std::max(cy - radius, 0); y <= std::min(cy + radius, 39); ++y) {
      for (int x = std::max(cx - radius, 0); x <= std::min(cx + radius, 47); ++x)
        frame.at(x, y) = static_cast<std::uint8_t>(100 + random() % 120);
    }
  }
  return frame;
}

RC_GTEST_PROP(GreyMoments, EqualPlainSumsInDoublePrecision, ()) {
  std::mt19937 random(*rc::gen::arbitrary<std::uint32_t>());
  const int left = static_cast<int>(random() % 40), top = static_cast<int>(random() % 32);
  const Grey8 frame = random_blob(random, left, top);
  const Regions regions = regions_above(frame);
  for (std::size_t i = 0; i < regions.regions.size(); ++i) {
    const GreyMoments fast = measure(frame, regions, i);
    const PlainMoments plain = plain_moments(pixels_around(frame, regions.runs_of(regions.regions[i])));
    const auto near = [](double a, double b, double tolerance) { return std::abs(a - b) <= tolerance; };
    RC_ASSERT(near(fast.x, plain.x, 1e-4) && near(fast.y, plain.y, 1e-4));
    RC_ASSERT(near(fast.steady_x, plain.steady_x, 1e-4) && near(fast.steady_y, plain.steady_y, 1e-4));
    RC_ASSERT(near(fast.weight, plain.weight, 1e-4 * plain.weight));
    RC_ASSERT(near(fast.background, plain.background, 1e-3) && near(fast.peak, plain.peak, 1e-3));
    RC_ASSERT(near(fast.m20, plain.m20, 1e-3) && near(fast.m11, plain.m11, 1e-3) && near(fast.m02, plain.m02, 1e-3));
    RC_ASSERT(near(fast.m30, plain.m30, 0.02) && near(fast.m21, plain.m21, 0.02));
    RC_ASSERT(near(fast.m12, plain.m12, 0.02) && near(fast.m03, plain.m03, 0.02));
  }
}

RC_GTEST_PROP(GreyMoments, MoveWithTheRegionAndDoNotChange, ()) {
  const auto seed = *rc::gen::arbitrary<std::uint32_t>();
  std::mt19937 one(seed), other(seed);
  const int dx = *rc::gen::inRange(0, 20), dy = *rc::gen::inRange(0, 14);
  const Grey8 here = random_blob(one, 8, 8), there = random_blob(other, 8 + dx, 8 + dy);
  const GreyMoments a = measure(here, regions_above(here)), b = measure(there, regions_above(there));
  RC_ASSERT(std::abs(b.x - a.x - static_cast<float>(dx)) < 1e-5F);
  RC_ASSERT(std::abs(b.y - a.y - static_cast<float>(dy)) < 1e-5F);
  const auto same = [](float first, float second) {
    return std::abs(first - second) < 1e-5F * std::max(std::abs(first), 100.F);
  };
  RC_ASSERT(same(a.weight, b.weight) && same(a.m20, b.m20) && same(a.m11, b.m11) && same(a.m02, b.m02));
  RC_ASSERT(same(a.m30, b.m30) && same(a.m21, b.m21) && same(a.m12, b.m12) && same(a.m03, b.m03));
}

RC_GTEST_PROP(GreyMoments, FindTheCentreBetweenPixels, ()) {
  const double x = 0.01 * *rc::gen::inRange(0, 100), y = 0.01 * *rc::gen::inRange(0, 100);
  const Box box{14 + x, 12 + y, 26.4 + x, 23 + y};
  const Grey8 frame = blurred_box(box);
  const GreyMoments moments = measure(frame, regions_above(frame));
  RC_ASSERT(std::abs(moments.x - 0.5 * (box.left + box.right)) < 0.08);
  RC_ASSERT(std::abs(moments.y - 0.5 * (box.top + box.bottom)) < 0.08);
  // Blurred by one pixel, the edge's height of a fifth lies that much further out.
  RC_ASSERT(std::abs(moments.weight / (13.9 * 12.5) - 1) < 0.15);
}

TEST(GreyMoments, OfSixteenBitsAreThoseOfEight) {
  const Grey8 frame = blurred_box({14.3, 12.8, 26, 23}, 2);
  const Regions regions = regions_above(frame);
  const Region& region = regions.regions[0];
  const GreyMoments eight = measure(frame, regions);
  const GreyMoments sixteen =
      GreyMomentMeter(kMarginPx).measure(sixteen_bits(frame).view(), region, regions.runs_of(region));
  EXPECT_NEAR(sixteen.x, eight.x, 1e-4);
  EXPECT_NEAR(sixteen.y, eight.y, 1e-4);
  EXPECT_NEAR(sixteen.weight, eight.weight, 1e-2);
  EXPECT_NEAR(sixteen.peak / 257, eight.peak, 1e-2);
}

TEST(GreyMoments, OfAnEvenPatchWeighNothing) {
  const Grey8 frame(20, 20, 200);
  EXPECT_EQ(measure(frame, regions_above(frame)).weight, 0);
}

TEST(GreyMoments, LevelTheLight) {
  constexpr double kShading = 0.03;
  const Box box{14.3, 12.8, 27, 23};
  const Grey8 frame = blurred_box(box, 0, kShading);
  const Regions regions = regions_above(frame);
  const Region& region = regions.regions[0];
  const double middle = 0.5 * (box.left + box.right);
  const double as_seen = std::abs(measure(frame, regions).x - middle);
  const GreyMoments levelled = GreyMomentMeter(kMarginPx).measure_levelled(
      frame.view(), region, regions.runs_of(region), {static_cast<float>(kShading), 0.F});
  EXPECT_GT(as_seen, 0.08);
  EXPECT_LT(std::abs(levelled.x - middle), 0.3 * as_seen);
}

TEST(GreyMoments, InACellLeaveTheNeighboursOut) {
  const Box box{14.3, 12.8, 26, 23};
  Grey8 frame = blurred_box(box);
  const LatticeFrame lattice_frame = 1.2F * LatticeFrame::Identity();
  const Eigen::Vector2f centre(20.2F, 17.9F);
  const auto in_cell = [&] {
    return GreyMomentMeter(kMarginPx).measure_cell(frame.view(), centre, lattice_frame, 7.F, {0.F, 0.F});
  };
  const GreyMoments alone = in_cell();
  EXPECT_NEAR(alone.x, 20.15, 0.03);
  EXPECT_NEAR(alone.y, 17.9, 0.03);
  for (int y = 5; y < 30; ++y) {
    for (int x = 30; x < 42; ++x) frame.at(x, y) = 180;
  }
  const GreyMoments beside = in_cell();
  EXPECT_EQ(beside.x, alone.x);
  EXPECT_EQ(beside.weight, alone.weight);
}

TEST(GreyMoments, InACellAreTheSameBesideTheBorder) {
  const Grey8 frame = blurred_box({14.3, 12.8, 26, 23});
  LatticeFrame lattice_frame;
  lattice_frame << 1.1F, 0.15F, -0.1F, 1.05F;
  const auto in_cell = [&](const ImageView<std::uint8_t>& view) {
    return GreyMomentMeter(kMarginPx).measure_cell(view, {20.2F, 17.9F}, lattice_frame, 7.F, {0.02F, -0.01F});
  };
  // The cell fits, what fills the patch's rows up to whole registers does not.
  const ImageView<std::uint8_t> narrow{frame.data(), 31, frame.height(), frame.width()};
  const GreyMoments inside = in_cell(frame.view()), beside = in_cell(narrow);
  EXPECT_NEAR(beside.x, inside.x, 1e-4);
  EXPECT_NEAR(beside.y, inside.y, 1e-4);
  EXPECT_NEAR(beside.weight, inside.weight, 1e-2);
  EXPECT_EQ(beside.peak, inside.peak);
}

// Bright as what lies beyond the border may be, in memory.
TEST(GreyMoments, InACellLeaveOutWhatIsBeyondTheBorder) {
  const Grey8 frame = blurred_box({14.3, 12.8, 26, 23});
  LatticeFrame lattice_frame;
  lattice_frame << 1.1F, 0.15F, -0.1F, 1.05F;
  const auto in_cell = [&](const ImageView<std::uint8_t>& view, const Eigen::Vector2f& centre_px) {
    return GreyMomentMeter(kMarginPx).measure_cell(view, centre_px, lattice_frame, 9.F, {0, 0});
  };
  const Eigen::Vector2f centre_px(20.2F, 17.9F);
  const GreyMoments whole = in_cell(frame.view(), centre_px);
  const int width = frame.width(), height = frame.height();
  for (const auto& [left, top, right, bottom] :
       {std::array{11, 0, width, height}, {0, 9, width, height}, {0, 0, 30, height}, {0, 0, width, 27}}) {
    Grey8 beside(width, height, 255);
    for (int y = top; y < bottom; ++y) std::copy_n(frame.view().row(y) + left, right - left, &beside.at(left, y));
    const ImageView<std::uint8_t> cut{&beside.at(left, top), right - left, bottom - top, width};
    const GreyMoments seen = in_cell(cut, centre_px - Eigen::Vector2f(left, top));
    EXPECT_NEAR(seen.x + static_cast<float>(left), whole.x, 1e-3);
    EXPECT_NEAR(seen.y + static_cast<float>(top), whole.y, 1e-3);
    EXPECT_NEAR(seen.weight, whole.weight, 1);  // there is less of the dark to tell its level by
    EXPECT_EQ(seen.peak, whole.peak);
  }
}

TEST(GreyMoments, InACellBeyondTheFrameWeighNothing) {
  const Grey8 frame = blurred_box({14, 12, 26, 23});
  const GreyMoments moments =
      GreyMomentMeter(kMarginPx).measure_cell(frame.view(), {-60.F, 300.F}, LatticeFrame::Identity(), 9.F, {0.F, 0.F});
  EXPECT_EQ(moments.weight, 0);
}

/// Boxes of many sizes, some at the border, one as large as no symbol is.
Grey8 some_boxes() {
  Grey8 frame(640, 400);
  std::mt19937 random(3);
  for (std::size_t i = 0; i < frame.size(); ++i) frame.data()[i] = static_cast<std::uint8_t>(20 + random() % 5);
  const auto fill = [&](int left, int top, int width, int height) {
    for (int y = top; y < top + height; ++y)
      for (int x = left; x < left + width; ++x) frame.at(x, y) = static_cast<std::uint8_t>(150 + random() % 60);
  };
  for (int row = 0; row < 5; ++row)
    for (int column = 0; column < 16; ++column)
      fill(column * 40, row * 50, 3 + static_cast<int>(random() % 30), 3 + static_cast<int>(random() % 40));
  fill(10, 270, 500, 120);
  return frame;
}

template <class T>
void expect_all_as_each(const Image<T>& frame, const Regions& regions) {
  std::vector<std::int32_t> which;
  for (std::size_t i = 0; i < regions.regions.size(); i += 1 + i % 2) which.push_back(static_cast<std::int32_t>(i));
  ASSERT_GT(which.size(), 30);
  std::vector<GreyMoments> all(which.size());
  GreyMomentMeter meter(kMarginPx);
  meter.measure_all(frame.view(), regions, which, all);
  for (std::size_t i = 0; i < which.size(); ++i) {
    const Region& region = regions.regions[which[i]];
    const GreyMoments each = meter.measure(frame.view(), region, regions.runs_of(region));
    EXPECT_GT(each.weight, 0);
    for (const auto part : {&GreyMoments::x, &GreyMoments::y, &GreyMoments::weight, &GreyMoments::m20,
                            &GreyMoments::m03, &GreyMoments::background, &GreyMoments::peak})
      EXPECT_EQ(all[i].*part, each.*part) << i;
  }
}

TEST(GreyMoments, OfManyRegionsAreThoseOfEach) {
  const Grey8 frame = some_boxes();
  const Regions regions = regions_above(frame);
  expect_all_as_each(frame, regions);
  expect_all_as_each(sixteen_bits(frame), regions);
}

}  // namespace
}  // namespace slsd
