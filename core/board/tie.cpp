// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/tie.hpp"

#include <opencv2/calib3d.hpp>

namespace slsd {
namespace {

constexpr std::size_t kLeastTies = 4;

struct Points {
  std::vector<cv::Point2d> board;
  std::vector<cv::Point2d> pixel;
};

Points points_of(std::span<const Tie> ties) {
  Points points;
  for (const Tie& tie : ties) {
    points.board.emplace_back(tie.board.x(), tie.board.y());
    points.pixel.emplace_back(tie.pixel.x(), tie.pixel.y());
  }
  return points;
}

// cv::findHomography throws if the points lie on a line.
cv::Mat solve(const Points& points, int method, double tolerance_px, cv::Mat& inliers) {
  try {
    return cv::findHomography(points.board, points.pixel, method, tolerance_px, inliers, 500, 0.999);
  } catch (const cv::Exception&) {
    return {};
  }
}

}  // namespace

std::optional<Homography> fit_homography(std::span<const Tie> ties) {
  if (ties.size() < kLeastTies) return std::nullopt;
  cv::Mat inliers;
  const cv::Mat solved = solve(points_of(ties), 0, 0, inliers);
  if (solved.empty()) return std::nullopt;
  Homography homography;
  for (int i = 0; i < 9; ++i) homography.matrix(i / 3, i % 3) = solved.at<double>(i / 3, i % 3);
  if (!homography.matrix.allFinite()) return std::nullopt;
  return homography;
}

std::vector<std::size_t> consensus(std::span<const Tie> ties, double tolerance_px) {
  std::vector<std::size_t> agreed;
  if (ties.size() < kLeastTies) return agreed;
  cv::Mat inliers;
  if (solve(points_of(ties), cv::RANSAC, tolerance_px, inliers).empty()) return agreed;
  for (std::size_t i = 0; i < ties.size(); ++i) {
    if (inliers.at<unsigned char>(static_cast<int>(i)) != 0) agreed.push_back(i);
  }
  return agreed;
}

}  // namespace slsd
