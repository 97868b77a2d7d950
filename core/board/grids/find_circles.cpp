// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/grids/find_circles.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "core/board/grids/disc.hpp"
#include "core/board/grids/grid_order.hpp"
#include "core/board/measured_points.hpp"

namespace slsd {
namespace {

constexpr int kReducedWidthPx = 1000;
constexpr double kMaxStrayOfSpacing = 0.35;  // largest distance from a homography of the whole board; lens distortion
                                             // is smaller
constexpr double kLeastShare = 0.8;          // share of the discs
constexpr double kWhiteOfGap = 0.8;          // share of half the gap between two discs

cv::Ptr<cv::FeatureDetector> disc_detector(const cv::Mat& image) {
  cv::SimpleBlobDetector::Params params;
  params.minArea = 12;
  params.maxArea = static_cast<float>(image.total()) / 16;
  params.minDistBetweenBlobs = 4;
  params.minCircularity = 0.6F;
  params.filterByCircularity = true;
  params.filterByInertia = true;
  params.minInertiaRatio = 0.1F;
  params.minConvexity = 0.85F;
  return cv::SimpleBlobDetector::create(params);
}

std::vector<Eigen::Vector2d> search(const Grey8& grey, const Board& board, double scale) {
  const cv::Mat whole(grey.height(), grey.width(), CV_8UC1, const_cast<std::uint8_t*>(grey.data()));
  cv::Mat image = whole;
  if (scale < 1) cv::resize(whole, image, {}, scale, scale, cv::INTER_AREA);
  std::vector<cv::Point2f> centres;
  constexpr int kFlags = cv::CALIB_CB_ASYMMETRIC_GRID | cv::CALIB_CB_CLUSTERING;
  const cv::Size size(board.columns, board.rows);
  const bool found = cv::findCirclesGrid(image, size, centres, kFlags, disc_detector(image)) ||
                     cv::findCirclesGrid(image, size, centres, cv::CALIB_CB_ASYMMETRIC_GRID, disc_detector(image));
  std::vector<Eigen::Vector2d> pixels;
  for (const auto& centre : centres) {
    pixels.emplace_back((Eigen::Vector2d(centre.x, centre.y).array() + 0.5) / scale - 0.5);
  }
  return found ? pixels : std::vector<Eigen::Vector2d>();
}

std::vector<Eigen::Vector2d> search(const Grey8& grey, const Board& board) {
  const double scale = std::min(1.0, static_cast<double>(kReducedWidthPx) / grey.width());
  auto centres = search(grey, board, scale);
  if (centres.empty() && scale < 1) centres = search(grey, board, 1);
  return centres;
}

bool fits(const GridOrder& order, const Board& board) {
  const auto ties = ties_of(order, board);
  const auto whole = fit_homography(ties);
  if (!whole) return false;
  return std::ranges::all_of(ties, [&](const Tie& tie) {
    const double spacing_px = board.pitch_mm * whole->jacobian(tie.board).colwise().norm().minCoeff();
    return (whole->map(tie.board) - tie.pixel).norm() < kMaxStrayOfSpacing * spacing_px;
  });
}

std::vector<GridOrder> fitting_orders(const std::vector<Eigen::Vector2d>& centres, const Board& board) {
  if (centres.size() != static_cast<std::size_t>(board.point_count())) return {};
  auto orders = grid_orders(centres, board);
  std::erase_if(orders, [&](const GridOrder& order) { return !fits(order, board); });
  return orders;
}

tl::unexpected<Error> refuse(const Grey8& grey, const Board& board, bool seen) {
  if (!fitting_orders(search(mirrored(grey), board), board).empty()) {
    return fail(ErrorCode::kMismatch,
                describe(board) + " appears mirrored; turn off the camera's mirroring, or remove the mirror");
  }
  if (seen) return fail(ErrorCode::kMismatch, "discs are visible, but not where " + describe(board) + " has them");
  return fail(ErrorCode::kNotFound, describe(board) + " is not visible; light it, focus, and hold all of it in view");
}

std::vector<MeasuredPoint> measure(const BoardPhoto& photo, const Board& board, const GridOrder& order) {
  const double radius = board.mark_mm / 2;
  const double clear = radius + kWhiteOfGap * (std::sqrt(2) * board.pitch_mm - board.mark_mm) / 2;
  std::vector<MeasuredPoint> discs;
  for (int id = 0; id < board.point_count(); ++id) {
    const Eigen::Vector2d place = board.point(id).head<2>();
    const auto local = fit_homography(ties_around(order, board, id, 2));
    if (!local) continue;
    const auto disc = measure_disc(photo.light, *local, place, radius, clear);
    if (!disc) continue;
    discs.push_back({{id, disc->centroid - perspective_bias(*local, place, radius)}, disc->step, disc->blur_px});
  }
  return discs;
}

// Centroids of the ellipses, measured once, give better homographies for the second measurement.
GridOrder improved(GridOrder order, const std::vector<MeasuredPoint>& discs) {
  for (const auto& disc : discs) order[disc.point.id] = disc.point.pixel;
  return order;
}

}  // namespace

Result<BoardSighting> find_circles(const BoardPhoto& photo, const Board& board) {
  const auto centres = search(photo.grey, board);
  const auto orders = fitting_orders(centres, board);
  if (orders.empty()) return refuse(photo.grey, board, !centres.empty());
  const auto once = measure(photo, board, orders.front());
  auto discs = measure(photo, board, improved(orders.front(), once));
  if (!span_a_plane(discs, board, static_cast<std::size_t>(kLeastShare * board.point_count()))) {
    return fail(ErrorCode::kNotFound,
                "too few discs of " + describe(board) + " are clearly visible; add light, and hold it still");
  }
  auto sighting = summarise(std::move(discs), photo, board);
  sighting.half_turn_ambiguous = orders.size() > 1;
  return sighting;
}

}  // namespace slsd
