// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/observe/gray_code.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <tuple>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>
#include <opencv2/structured_light/graycodepattern.hpp>

#include "core/calibrate/observe/gray_axis.hpp"
#include "core/exposure/light_levels.hpp"

namespace slsd {
namespace {

using cv::structured_light::GrayCodePattern;

/// Sides of the projector squares whose pixels are combined, finest first. The first side that gives enough points is
/// used.
constexpr int kSquareSidesPx[] = {8, 16, 32};
constexpr std::size_t kPointsEnough = 150;
/// Members that a square needs.
constexpr std::size_t kSeenMin = 12;
/// Grey levels of 255 between lit and unlit for a pixel to be certain.
constexpr int kContrastMin = 12;
/// Camera pixels by which a member may lie off its square's affine map, in addition to its place in its bin.
constexpr double kMemberOffPx = 0.75;
/// Number of pixels above which their shares are meaningful.
constexpr std::ptrdiff_t kPixelsMin = 2000;
constexpr double kBeyondShareMax = 0.02, kFittingShareMin = 0.3;

/// @param full  the level of a saturated pixel, which becomes 255. If it is 255 already, nothing is copied
cv::Mat to_mat(const GreyView& view, double full) {
  return std::visit(
      [full](const auto& image) {
        using Pixel = std::remove_cvref_t<decltype(*image.pixels)>;
        cv::Mat borrowed(image.height, image.width, sizeof(Pixel) == 1 ? CV_8U : CV_16U,
                         const_cast<Pixel*>(image.pixels), static_cast<std::size_t>(image.stride) * sizeof(Pixel));
        if (sizeof(Pixel) == 1 && full == 255) return borrowed;
        cv::Mat copy;
        borrowed.convertTo(copy, CV_8U, 255 / full);
        return copy;
      },
      view);
}

/// A camera pixel and its place in the projector. Eight bytes, because a camera may have tens of millions.
struct Member {
  std::uint16_t x, y;                          // camera px
  std::uint16_t half_pixels_u, half_pixels_v;  // projector, from the first pixel's centre

  [[nodiscard]] Eigen::Vector2d camera_px() const { return {x, y}; }
  [[nodiscard]] Eigen::Vector2d projector_px() const { return {0.5 * half_pixels_u, 0.5 * half_pixels_v}; }
};

/// Members of a square, and the width of the code's bins, projector px.
struct Square {
  std::vector<Member> members;
  Eigen::Vector2d bin_px{1, 1};
};

/// Distances of the members from the least-squares affine map from projector to camera over their square. The part due
/// to their places in their bins is subtracted.
std::vector<double> distances_from_affine(const Square& square) {
  const std::vector<Member>& members = square.members;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Identity() * 1e-9;
  Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
  const Eigen::Vector2d origin = members[0].projector_px();
  for (const Member& member : members) {
    const Eigen::Vector3d p = (member.projector_px() - origin).homogeneous();
    normal += p * p.transpose();
    right += p * member.camera_px().transpose();
  }
  const Eigen::Matrix<double, 3, 2> affine = normal.ldlt().solve(right);
  const double half_bin_px = 0.5 * (affine.topRows<2>().transpose() * square.bin_px.asDiagonal()).norm();
  std::vector<double> distances;
  for (const Member& member : members) {
    const Eigen::Vector3d p = (member.projector_px() - origin).homogeneous();
    distances.push_back((affine.transpose() * p - member.camera_px()).norm() - half_bin_px);
  }
  return distances;
}

/// Means of the fitting members, and their certainty.
ProjectedPoint mean_of(const Square& square) {
  ProjectedPoint mean;
  mean.camera_px = mean.projector_px = Eigen::Vector2d::Zero();
  const auto count = static_cast<double>(square.members.size());
  for (const Member& member : square.members) {
    mean.camera_px += member.camera_px() / count;
    mean.projector_px += member.projector_px() / count;
  }
  const double sigma_px = square.bin_px.norm() / std::sqrt(12);  // standard deviation of a place in a bin
  mean.sigma_px = std::max(sigma_px / std::sqrt(count), 0.02);
  return mean;
}

/// Removes the members that do not fit.
void keep_fitting(Square& square) {
  constexpr int kRounds = 2;
  for (int round = 0; round < kRounds && square.members.size() >= kSeenMin; ++round) {
    const std::vector<double> distances = distances_from_affine(square);
    std::vector<Member> left;
    for (std::size_t i = 0; i < distances.size(); ++i) {
      if (distances[i] < kMemberOffPx) left.push_back(square.members[i]);
    }
    square.members = std::move(left);
  }
}

cv::Ptr<GrayCodePattern> code_of(const ImageSize& projector) {
  return GrayCodePattern::create(projector.width_px, projector.height_px);
}

/// The code's images, if they all have one size.
Result<std::vector<cv::Mat>> checked_images(const GrayCapture& capture, const ImageSize& projector) {
  const std::size_t expected = gray_code_images(projector);
  if (capture.code.size() != expected) {
    return fail(ErrorCode::kMismatch,
                "the Gray code has " + std::to_string(capture.code.size()) + " images, but " +
                    std::to_string(expected) + " fit a projector of " + std::to_string(projector.width_px) + "x" +
                    std::to_string(projector.height_px) + " pixels; set the projector's size to that of the captures");
  }
  const double full = guess_full_level(capture.white);  // full level of all images: a comparison needs one scale
  std::vector<cv::Mat> images{to_mat(capture.white, full), to_mat(capture.black, full)};
  for (const GreyView& image : capture.code) images.push_back(to_mat(image, full));
  if (std::ranges::any_of(images, [&](const cv::Mat& image) { return image.size() != images[0].size(); })) {
    return fail(ErrorCode::kMismatch, "the images of the Gray code differ in size");
  }
  return images;
}

/// Camera pixels that are brighter in one picture than in another.
std::vector<cv::Point> brighter_pixels(const cv::Mat& light, const cv::Mat& dark,
                                       const std::function<bool(int x, int y)>& wanted) {
  std::vector<cv::Point> brighter;
  for (int y = 0; y < light.rows; ++y) {
    for (int x = 0; x < light.cols; ++x) {
      const bool is = light.at<std::uint8_t>(y, x) >= dark.at<std::uint8_t>(y, x) + kContrastMin;
      if (is && wanted(x, y)) brighter.emplace_back(x, y);
    }
  }
  return brighter;
}

/// Pixels that the projector lights.
/// @errors kMismatch: white and black are swapped
Result<std::vector<cv::Point>> lit_pixels(const cv::Mat& white, const cv::Mat& black,
                                          const std::function<bool(int x, int y)>& wanted) {
  auto lit = brighter_pixels(white, black, wanted);
  if (std::ssize(brighter_pixels(black, white, wanted)) > std::max(std::ssize(lit), kPixelsMin)) {
    return fail(ErrorCode::kMismatch, "white.png is darker than black.png: swap the two");
  }
  return lit;
}

struct Reading {
  std::vector<Member> seen;
  Eigen::Vector2d bin_px{1, 1};
};

/// The place of each lit pixel.
/// @errors kMismatch: places outside the projector
Result<Reading> read_places(std::span<const cv::Mat> code, const ImageSize& projector,
                            const std::vector<cv::Point>& lit) {
  const auto columns = static_cast<std::size_t>(std::bit_width(static_cast<unsigned>(projector.width_px - 1)));
  GrayAxis across(code.first(2 * columns)), down(code.subspan(2 * columns));
  across.leave_out_unseen(lit);
  down.leave_out_unseen(lit);
  Reading reading{{}, {across.bin_px(), down.bin_px()}};
  std::ptrdiff_t beyond = 0;
  for (const cv::Point& pixel : lit) {
    const auto u = across.place_px(pixel), v = down.place_px(pixel);
    if (!u || !v) continue;
    if (*u >= projector.width_px || *v >= projector.height_px) {
      ++beyond;
      continue;
    }
    const auto small = [](auto value) { return static_cast<std::uint16_t>(value); };
    reading.seen.push_back({small(pixel.x), small(pixel.y), small(2 * *u), small(2 * *v)});
  }
  const auto all = static_cast<double>(std::ssize(reading.seen) + beyond);
  if (beyond > kPixelsMin / 10 && static_cast<double>(beyond) > kBeyondShareMax * all) {
    return fail(ErrorCode::kMismatch,
                "the Gray code reaches beyond " + std::to_string(projector.width_px) + "x" +
                    std::to_string(projector.height_px) +
                    " pixels, or its pictures are in another order; set the projector's size to that of the captures");
  }
  return reading;
}

/// The points of all squares with enough members, and the total number of members. Reorders the pixels so that those of
/// a square are adjacent.
std::pair<std::vector<ProjectedPoint>, std::size_t> summarise(Reading& reading, int side_px) {
  const auto place = [side_px](const Member& member) {
    return std::pair(member.half_pixels_u / (2 * side_px), member.half_pixels_v / (2 * side_px));
  };
  std::ranges::sort(reading.seen, {},
                    [&](const Member& member) { return std::tuple(place(member), member.y, member.x); });
  std::pair<std::vector<ProjectedPoint>, std::size_t> points;
  for (auto first = reading.seen.begin(); first != reading.seen.end();) {
    const auto last =
        std::find_if(first, reading.seen.end(), [&](const Member& member) { return place(member) != place(*first); });
    Square square{{first, last}, reading.bin_px};
    first = last;
    keep_fitting(square);
    if (square.members.size() < kSeenMin) continue;
    points.first.push_back(mean_of(square)), points.second += square.members.size();
  }
  return points;
}

}  // namespace

std::size_t gray_code_images(const ImageSize& projector) {
  return code_of(projector)->getNumberOfPatternImages();
}

std::vector<Grey8> draw_gray_code(const ImageSize& projector) {
  std::vector<cv::Mat> drawn;
  code_of(projector)->generate(drawn);
  std::vector<Grey8> images;
  for (const cv::Mat& mat : drawn) {
    Grey8& image = images.emplace_back(mat.cols, mat.rows);
    for (int y = 0; y < mat.rows; ++y) std::copy_n(mat.ptr<std::uint8_t>(y), mat.cols, image.row(y));
  }
  return images;
}

Result<std::vector<ProjectedPoint>> read_gray_code(const GrayCapture& capture, const ImageSize& projector,
                                                   const std::function<bool(int x, int y)>& wanted) {
  const auto images = checked_images(capture, projector);
  if (!images) return tl::unexpected(images.error());
  const auto lit = lit_pixels(images->at(0), images->at(1), wanted);
  if (!lit) return tl::unexpected(lit.error());
  auto reading = read_places(std::span(*images).subspan(2), projector, *lit);
  if (!reading) return tl::unexpected(reading.error());
  std::vector<ProjectedPoint> points;
  std::size_t fitting = 0;
  for (const int side_px : kSquareSidesPx) {
    std::tie(points, fitting) = summarise(*reading, side_px);
    if (points.size() >= kPointsEnough) break;
  }
  if (std::ssize(reading->seen) > kPixelsMin &&
      static_cast<double>(fitting) < kFittingShareMin * static_cast<double>(reading->seen.size())) {
    return fail(ErrorCode::kMismatch,
                "neighbouring pixels have distant Gray codes: the board or the camera moved, or the pictures are not "
                "in the order of OpenCV's GrayCodePattern::generate (columns, then rows; highest bit first; each "
                "followed by its inverse)");
  }
  return points;
}

}  // namespace slsd
