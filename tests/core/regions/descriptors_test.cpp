// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/regions/descriptors.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>
#include <opencv2/imgproc.hpp>

#include "core/regions/convex_hull.hpp"

namespace slsd {
namespace {

constexpr double kExact = 1e-9;

Grey8 draw(const std::vector<std::string>& rows) {
  Grey8 mask(static_cast<int>(rows[0].size()), static_cast<int>(rows.size()));
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) mask.at(x, y) = rows[y][x] == '#' ? 255 : 0;
  }
  return mask;
}

Grey8 rectangle(int width, int height) {
  return Grey8(width, height, 1);
}

Grey8 right_triangle(int side) {
  Grey8 mask(side, side);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x <= y; ++x) mask.at(x, y) = 1;
  }
  return mask;
}

Grey8 disc(int radius) {
  Grey8 mask(2 * radius + 1, 2 * radius + 1);
  for (int y = -radius; y <= radius; ++y) {
    for (int x = -radius; x <= radius; ++x) mask.at(x + radius, y + radius) = x * x + y * y <= radius * radius;
  }
  return mask;
}

Grey8 quarter_turn(const Grey8& mask) {
  Grey8 turned(mask.height(), mask.width());
  for (int y = 0; y < turned.height(); ++y) {
    for (int x = 0; x < turned.width(); ++x) turned.at(x, y) = mask.at(y, mask.height() - 1 - x);
  }
  return turned;
}

Grey8 framed(const Grey8& mask, int left, int top) {
  Grey8 larger(mask.width() + left + 3, mask.height() + top + 2);
  for (int y = 0; y < mask.height(); ++y) std::copy_n(mask.row(y), mask.width(), larger.row(y + top) + left);
  return larger;
}

// A connected blob: a random walk of discs.
Grey8 blob(std::uint32_t seed) {
  std::mt19937 random(seed);
  cv::Mat1b canvas(40, 40, std::uint8_t{0});
  cv::Point at(20, 20);
  for (int step = 0; step < 12; ++step) {
    cv::circle(canvas, at, 2 + static_cast<int>(random() % 3), 1, cv::FILLED);
    at += cv::Point(static_cast<int>(random() % 7) - 3, static_cast<int>(random() % 7) - 3);
    at = {std::clamp(at.x, 6, 33), std::clamp(at.y, 6, 33)};
  }
  Grey8 mask(40, 40);
  std::copy(canvas.begin(), canvas.end(), mask.data());
  return mask;
}

cv::Mat1b as_mat(const Grey8& mask) {
  cv::Mat1b mat(mask.height(), mask.width());
  std::copy_n(mask.data(), mask.size(), mat.begin());
  return mat;
}

void expect_same_shape(const Descriptors& a, const Descriptors& b) {
  EXPECT_NEAR(a.rectangularity, b.rectangularity, kExact);
  EXPECT_NEAR(a.eccentricity, b.eccentricity, 1e-6);
  EXPECT_NEAR(a.aspect_ratio, b.aspect_ratio, 1e-6);
  EXPECT_NEAR(a.convex_to_area, b.convex_to_area, kExact);
  EXPECT_NEAR(a.perimeter_to_area, b.perimeter_to_area, kExact);
  EXPECT_EQ(a.area_px, b.area_px);
  EXPECT_EQ(a.equivalent_diameter_px, b.equivalent_diameter_px);
  EXPECT_EQ(a.filled_area_ratio, b.filled_area_ratio);
  EXPECT_EQ(a.euler_number, b.euler_number);
}

TEST(DescribeShape, SquareHasRectangularityOneAndEccentricityZero) {
  const Descriptors square = describe_shape(rectangle(16, 16));
  EXPECT_NEAR(square.rectangularity, 1, kExact);
  EXPECT_NEAR(square.eccentricity, 0, 1e-6);
  EXPECT_NEAR(square.aspect_ratio, 1, kExact);
  EXPECT_NEAR(square.convex_to_area, 1, kExact);
  EXPECT_NEAR(square.equivalent_diameter_px, 16 * 2 / std::sqrt(std::numbers::pi), kExact);
  EXPECT_EQ(square.area_px, 256);
  EXPECT_NEAR(square.perimeter_to_area * square.area_px, 64, 2);
  EXPECT_EQ(square.filled_area_ratio, 1);
  EXPECT_EQ(square.euler_number, 1);
  EXPECT_EQ(square.centroid_px, Eigen::Vector2d(7.5, 7.5));
}

TEST(DescribeShape, BarHasEccentricityNearOneAndLiesAlongX) {
  const Descriptors bar = describe_shape(rectangle(16, 4));
  EXPECT_NEAR(bar.eccentricity, std::sqrt(1 - 1. / 16), kExact);
  EXPECT_NEAR(bar.aspect_ratio, 0.25, kExact);
  EXPECT_NEAR(bar.rectangularity, 1, kExact);
  EXPECT_NEAR(bar.orientation_rad, 0, kExact);
  EXPECT_NEAR(describe_shape(rectangle(4, 16)).orientation_rad, std::numbers::pi / 2, kExact);
}

TEST(DescribeShape, TriangleHasThePapersRectangularity) {
  const Descriptors triangle = describe_shape(right_triangle(16));
  EXPECT_NEAR(triangle.rectangularity, 0.53, 0.005);
  EXPECT_NEAR(triangle.orientation_rad, std::numbers::pi / 4, kExact);
  EXPECT_NEAR(triangle.centroid_px.x(), 5, kExact);
  EXPECT_NEAR(triangle.centroid_px.y(), 10, kExact);
}

TEST(DescribeShape, DiagonalSquaresAreOnePartAndHalfTheirRectangle) {
  const Descriptors squares = describe_shape(draw({"###...",  //
                                                   "###...",  //
                                                   "###...",  //
                                                   "...###",  //
                                                   "...###",  //
                                                   "...###"}));
  EXPECT_EQ(squares.euler_number, 1);
  EXPECT_NEAR(squares.rectangularity, 0.5, kExact);
  EXPECT_NEAR(squares.convex_to_area, 1.5, kExact);
  EXPECT_NEAR(squares.orientation_rad, std::numbers::pi / 4, kExact);
}

TEST(DescribeShape, CountsPartsLessHoles) {
  const Descriptors ring = describe_shape(draw({"#####",  //
                                                "#.#.#",  //
                                                "#####"}));
  EXPECT_EQ(ring.euler_number, -1);
  EXPECT_NEAR(ring.filled_area_ratio, 13. / 15, kExact);
  const Descriptors parts = describe_shape(draw({"##..##",  //
                                                 "##..##"}));
  EXPECT_EQ(parts.euler_number, 2);
  EXPECT_EQ(parts.filled_area_ratio, 1);
}

TEST(DescribeShape, ADiagonalGapIsClosed) {
  const Descriptors diamond = describe_shape(draw({".#.",  //
                                                   "#.#",  //
                                                   ".#."}));
  EXPECT_EQ(diamond.euler_number, 0);
  EXPECT_NEAR(diamond.filled_area_ratio, 0.8, kExact);
}

TEST(DescribeShape, PerimeterOfADiscIsNearTheCircles) {
  for (const int radius : {6, 10, 20}) {
    const Descriptors shape = describe_shape(disc(radius));
    EXPECT_NEAR(shape.perimeter_to_area * shape.area_px / (2 * std::numbers::pi * (radius + 0.5)), 1, 0.08) << radius;
  }
}

TEST(DescribeShape, NothingLitIsAllZeros) {
  const Descriptors nothing = describe_shape(Grey8(5, 4));
  EXPECT_EQ(nothing.area_px, 0);
  EXPECT_EQ(nothing.rectangularity, 0);
  EXPECT_EQ(describe_shape(Grey8()).euler_number, 0);
}

TEST(DescribeShape, OnePixelIsASquare) {
  const Descriptors pixel = describe_shape(rectangle(1, 1));
  EXPECT_NEAR(pixel.rectangularity, 1, kExact);
  EXPECT_NEAR(pixel.eccentricity, 0, kExact);
  EXPECT_EQ(pixel.euler_number, 1);
}

RC_GTEST_PROP(DescribeShape, IsFreeOfPosition, ()) {
  const Grey8 mask = blob(*rc::gen::arbitrary<std::uint32_t>());
  const int left = *rc::gen::inRange(0, 20), top = *rc::gen::inRange(0, 20);
  const Descriptors here = describe_shape(mask), there = describe_shape(framed(mask, left, top));
  expect_same_shape(here, there);
  EXPECT_NEAR((there.centroid_px - here.centroid_px - Eigen::Vector2d(left, top)).norm(), 0, kExact);
  EXPECT_NEAR(std::cos(2 * (here.orientation_rad - there.orientation_rad)), 1, 1e-6);
}

RC_GTEST_PROP(DescribeShape, IsFreeOfQuarterTurns, ()) {
  const Grey8 mask = blob(*rc::gen::arbitrary<std::uint32_t>());
  const Descriptors here = describe_shape(mask), turned = describe_shape(quarter_turn(mask));
  expect_same_shape(here, turned);
  EXPECT_NEAR(std::cos(2 * (here.orientation_rad + std::numbers::pi / 2 - turned.orientation_rad)), 1, 1e-6);
}

// OpenCV as a second implementation. Its contour runs through pixel centres, ours around the pixels: its hull and
// rectangle are taken of the pixels' corners, doubled so that they are whole numbers.
RC_GTEST_PROP(DescribeShape, AgreesWithOpenCv, ()) {
  const Grey8 mask = blob(*rc::gen::arbitrary<std::uint32_t>());
  const Descriptors shape = describe_shape(mask);

  const cv::Moments moments = cv::moments(as_mat(mask), true);
  EXPECT_EQ(shape.area_px, moments.m00);
  EXPECT_NEAR(shape.centroid_px.x(), moments.m10 / moments.m00, kExact);
  const double a = moments.mu20 / moments.m00 + 1. / 12, b = moments.mu11 / moments.m00,
               c = moments.mu02 / moments.m00 + 1. / 12;
  cv::Mat1d eigenvalues;
  cv::eigen(cv::Mat1d(cv::Matx22d(a, b, b, c)), eigenvalues);
  EXPECT_NEAR(shape.eccentricity, std::sqrt(1 - eigenvalues(1) / eigenvalues(0)), 1e-6);
  EXPECT_NEAR(shape.aspect_ratio, std::sqrt(eigenvalues(1) / eigenvalues(0)), 1e-6);

  std::vector<cv::Point> corners, hull;
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) {
      if (mask.at(x, y) == 0) continue;
      for (const cv::Point& corner : {cv::Point(-1, -1), {1, -1}, {-1, 1}, {1, 1}}) {
        corners.push_back(2 * cv::Point(x, y) + corner);
      }
    }
  }
  cv::convexHull(corners, hull);
  EXPECT_NEAR(shape.convex_to_area, cv::contourArea(hull) / 4 / shape.area_px, 1e-6);
  const cv::RotatedRect box = cv::minAreaRect(corners);
  EXPECT_NEAR(shape.rectangularity, shape.area_px * 4 / (double(box.size.width) * box.size.height), 1e-4);

  std::vector<std::vector<cv::Point>> contours;
  std::vector<cv::Vec4i> levels;
  cv::findContours(as_mat(framed(mask, 1, 1)), contours, levels, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);
  int outer = 0, holes = 0;
  cv::Mat1b filled(mask.height() + 8, mask.width() + 8, std::uint8_t{0});
  for (std::size_t i = 0; i < contours.size(); ++i) {
    (levels[i][3] < 0 ? outer : holes) += 1;
    if (levels[i][3] < 0) cv::drawContours(filled, contours, static_cast<int>(i), 1, cv::FILLED);
  }
  EXPECT_EQ(shape.euler_number, outer - holes);
  EXPECT_NEAR(shape.filled_area_ratio, shape.area_px / cv::countNonZero(filled), kExact);
}

TEST(ConvexHull, OfAnLCutsItsNotch) {
  const auto hull = convex_hull(draw({"#..",  //
                                      "#..",  //
                                      "###"})
                                    .view());
  EXPECT_EQ(hull.size(), 5U);
  EXPECT_NEAR(polygon_area(hull), 7, kExact);
}

TEST(ConvexHull, OfNothingIsNothing) {
  EXPECT_TRUE(convex_hull(Grey8(3, 3).view()).empty());
}

TEST(LeastRectangleArea, FitsASquareThatStandsOnItsTip) {
  EXPECT_NEAR(least_rectangle_area({{0, -2}, {2, 0}, {0, 2}, {-2, 0}}), 8, kExact);
}

}  // namespace
}  // namespace slsd
