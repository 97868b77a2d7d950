// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/grids/find_chessboard.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "core/board/grids/corner_lattice.hpp"
#include "core/board/grids/grid_order.hpp"

namespace slsd {
namespace {

constexpr int kReducedWidthPx = 900;
constexpr int kLeastPerCent = 80;  // share of the corners

cv::Mat matrix_of(const Grey8& image) {
  return {image.height(), image.width(), CV_8UC1, const_cast<std::uint8_t*>(image.data())};
}

double reduction_of(const Grey8& image) {
  return std::min(1.0, static_cast<double>(kReducedWidthPx) / image.width());
}

std::vector<Eigen::Vector2d> original(const std::vector<cv::Point2f>& corners, double scale) {
  std::vector<Eigen::Vector2d> pixels;
  for (const auto& corner : corners) {
    pixels.emplace_back((Eigen::Vector2d(corner.x, corner.y).array() + 0.5) / scale - 0.5);
  }
  return pixels;
}

cv::Mat reduced(const cv::Mat& image, double scale) {
  if (scale >= 1) return image;
  cv::Mat small;
  cv::resize(image, small, {}, scale, scale, cv::INTER_AREA);
  return small;
}

/// Tells whether there are far more bright patches than a board has squares, as in the projected pattern. With them,
/// the search by squares would take unreasonably long.
bool is_crowded(const Grey8& image, const Board& board) {
  constexpr int kAround = 31, kBrighter = 5, kLeastPx = 12, kOthersMax = 200;
  cv::Mat bright, labels, statistics, centres;
  cv::adaptiveThreshold(reduced(matrix_of(image), reduction_of(image)), bright, 255, cv::ADAPTIVE_THRESH_MEAN_C,
                        cv::THRESH_BINARY, kAround, -kBrighter);
  const int count = cv::connectedComponentsWithStats(bright, labels, statistics, centres);
  int patches = 0;
  for (int i = 1; i < count; ++i) patches += statistics.at<int>(i, cv::CC_STAT_AREA) >= kLeastPx;
  return patches > (board.columns + 1) * (board.rows + 1) + kOthersMax;
}

// Searches by the black squares' corners: quick, and finds small squares beside a bright border and in a dark room.
std::vector<cv::Point2f> search_by_squares(const cv::Mat& image, const cv::Size& size) {
  std::vector<cv::Point2f> corners;
  constexpr int kFlags = cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK;
  if (!cv::findChessboardCorners(image, size, corners, kFlags)) corners.clear();
  return corners;
}

// Searches by the saddles: slower, and finds blurred boards.
std::vector<cv::Point2f> search_by_saddles(const cv::Mat& image, const cv::Size& size, int flags) {
  std::vector<cv::Point2f> corners;
  if (!cv::findChessboardCornersSB(image, size, corners, flags)) corners.clear();
  return corners;
}

std::vector<Eigen::Vector2d> search(const Grey8& image, const Board& board, bool crowded) {
  const double scale = reduction_of(image);
  const cv::Mat small = reduced(matrix_of(image), scale);
  const cv::Size size(board.columns, board.rows);
  auto corners = crowded ? std::vector<cv::Point2f>() : search_by_squares(small, size);
  if (corners.empty()) corners = search_by_saddles(small, size, cv::CALIB_CB_EXHAUSTIVE);
  if (corners.empty()) corners = search_by_saddles(small, size, cv::CALIB_CB_NORMALIZE_IMAGE);
  if (!corners.empty() || scale == 1 || crowded) return original(corners, scale);
  return original(search_by_squares(matrix_of(image), size), 1);
}

struct Part {
  int columns = 0;
  int rows = 0;
  bool at_edge = false;  ///< touches the edge of the image
};

// The largest visible chessboard of any size.
Part largest_part(const Grey8& image) {
  const double scale = reduction_of(image);
  const cv::Mat small = reduced(matrix_of(image), scale);
  std::vector<cv::Point2f> corners;
  cv::Mat cells;
  constexpr int kFlags = cv::CALIB_CB_LARGER | cv::CALIB_CB_EXHAUSTIVE;
  if (!cv::findChessboardCornersSB(small, {3, 3}, corners, kFlags, cells) || cells.empty()) return {};
  Part part{cells.cols, cells.rows, false};
  const cv::Rect bounds = cv::boundingRect(corners);
  const int margin_x = bounds.width * 3 / 2 / std::max(1, cells.cols - 1);
  const int margin_y = bounds.height * 3 / 2 / std::max(1, cells.rows - 1);
  const cv::Rect inside(margin_x, margin_y, std::max(0, small.cols - 2 * margin_x),
                        std::max(0, small.rows - 2 * margin_y));
  part.at_edge = (bounds & inside) != bounds;
  return part;
}

tl::unexpected<Error> refuse(const Grey8& image, const Board& board) {
  const Part part = largest_part(image);
  const std::string name = describe(board);
  if (part.columns == 0) {
    return fail(ErrorCode::kNotFound, name + " is not visible; light it, focus, and hold all of it in view");
  }
  const std::string size = std::to_string(part.columns) + "x" + std::to_string(part.rows) + " inner corners";
  const bool larger = std::max(part.columns, part.rows) > std::max(board.columns, board.rows) ||
                      std::min(part.columns, part.rows) > std::min(board.columns, board.rows);
  if (larger) return fail(ErrorCode::kMismatch, "the picture shows another board: it has " + size + ", unlike " + name);
  if (part.at_edge) {
    return fail(ErrorCode::kNotFound, name + " is cut off by the image's edge: " + size +
                                          " are visible; show the whole chessboard with its white border");
  }
  return fail(ErrorCode::kNotFound,
              name + " is partly hidden, unevenly lit, or another board: " + size + " are visible");
}

// Empty if, in this order, the top left square would have the other colour.
std::vector<MeasuredPoint> fitted(const BoardPhoto& photo, const Board& board, const GridOrder& order,
                                  bool white_first) {
  CornerLattice lattice(photo.light, board, white_first);
  for (int id = 0; id < board.point_count(); ++id) {
    if (const auto local = fit_homography(ties_around(order, board, id, 1))) lattice.look_for(id, *local);
  }
  lattice.drop_outliers();
  return lattice.corners();
}

}  // namespace

Result<BoardSighting> find_chessboard(const BoardPhoto& photo, const Board& board) {
  const bool crowded = is_crowded(photo.grey, board);
  const auto found = search(photo.grey, board, crowded);
  if (found.empty() && crowded) {
    return fail(ErrorCode::kMismatch, describe(board) +
                                          " is not visible, but a fine texture is, such as the projected pattern; "
                                          "check that the white picture and the "
                                          "pattern's are not swapped");
  }
  if (found.size() != static_cast<std::size_t>(board.point_count())) return refuse(photo.grey, board);
  std::vector<MeasuredPoint> most;
  // By the black corner, if the board has a single one: it shows which end is up. A 9x7 board has four corners of the
  // same colour, black or white; as 7x9 it is the same board.
  const bool corners_alike = (board.columns + board.rows) % 2 == 0 && board.columns != board.rows;
  for (const bool white_first : {false, true}) {
    if (white_first && !(corners_alike && most.empty())) break;
    for (const auto& order : grid_orders(found, board)) {
      auto corners = fitted(photo, board, order, white_first);
      if (corners.size() > most.size()) most = std::move(corners);
    }
  }
  if (100 * most.size() < kLeastPerCent * found.size()) {
    return fail(ErrorCode::kNotFound, "only " + std::to_string(most.size()) + " of " + std::to_string(found.size()) +
                                          " corners of " + describe(board) +
                                          " are sharp enough; hold it still, focus, and add light");
  }
  auto sighting = summarise(std::move(most), photo, board);
  sighting.half_turn_ambiguous = (board.columns + board.rows) % 2 == 0;
  return sighting;
}

}  // namespace slsd
