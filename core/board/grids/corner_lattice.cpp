// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/grids/corner_lattice.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include <Eigen/LU>

#include "core/board/grids/saddle.hpp"

namespace slsd {
namespace {

constexpr double kLeastReachPx = 3;
constexpr double kGreatestReachPx = 14;
constexpr double kReachOfSquare = 0.38;        // for a chessboard
constexpr double kReachOfCharucoSquare = 0.2;  // reaches only the markers' black borders, which are symmetrical
constexpr double kMaxStrayOfSquare = 0.2;      // largest distance from its predicted place
constexpr double kOutlierOfSquare = 0.08;
constexpr double kLeastOutlierPx = 0.8;
constexpr int kNeighbourhood = 2;  // rows and columns to either side
constexpr std::size_t kLeastNeighbours = 5;

// Whether two rows have at least two corners each; otherwise a homography is poorly determined.
bool determine_a_homography(std::span<const Tie> ties) {
  std::map<double, int> in_row;
  for (const Tie& tie : ties) ++in_row[tie.board.y()];
  return ties.size() >= kLeastNeighbours && std::ranges::count_if(in_row, [](auto row) { return row.second > 1; }) > 1;
}

double reach(const Board& board, double square_px) {
  const double share = board.kind == BoardKind::kCharuco ? kReachOfCharucoSquare : kReachOfSquare;
  return std::clamp(share * square_px, kLeastReachPx, kGreatestReachPx);
}

}  // namespace

CornerLattice::CornerLattice(const Image<float>& light, const Board& board, bool white_first)
    : light_(&light), board_(&board), white_first_(white_first) {}

int CornerLattice::columns() const {
  return board_->kind == BoardKind::kCharuco ? board_->columns - 1 : board_->columns;
}

int CornerLattice::rows() const {
  return board_->kind == BoardKind::kCharuco ? board_->rows - 1 : board_->rows;
}

bool CornerLattice::look_for(int id, const Homography& local) {
  const Eigen::Vector2d place = board_->point(id).head<2>();
  const Eigen::Matrix2d step = local.jacobian(place) * board_->pitch_mm;
  const SaddleGuess guess{local.map(place), step.col(0), step.col(1)};
  if (step.determinant() <= 0) return false;  // seen from behind
  const auto saddle = fit_saddle(*light_, guess, reach(*board_, guess.square_px()));
  if (!saddle) return false;
  const bool first_is_black = (id % columns() + id / columns()) % 2 == 0;
  if ((saddle->step > 0) != (first_is_black != white_first_)) return false;
  if ((saddle->pixel - guess.pixel).norm() > std::max(1.5, kMaxStrayOfSquare * guess.square_px())) return false;
  corners_[id] = {{id, saddle->pixel}, saddle->step, saddle->blur_px};
  return true;
}

std::vector<Tie> CornerLattice::neighbours(int id) const {
  std::vector<Tie> ties;
  for (int row = id / columns() - kNeighbourhood; row <= id / columns() + kNeighbourhood; ++row) {
    for (int column = id % columns() - kNeighbourhood; column <= id % columns() + kNeighbourhood; ++column) {
      if (row < 0 || column < 0 || row >= rows() || column >= columns()) continue;
      const int other = row * columns() + column;
      const auto found = corners_.find(other);
      if (other == id || found == corners_.end()) continue;
      ties.push_back({board_->point(other).head<2>(), found->second.point.pixel});
    }
  }
  return ties;
}

bool CornerLattice::is_outlier(int id) const {
  const auto ties = neighbours(id);
  if (!determine_a_homography(ties)) return false;
  const auto local = fit_homography(ties);
  if (!local) return false;
  const Eigen::Vector2d place = board_->point(id).head<2>();
  const double square_px = board_->pitch_mm * local->jacobian(place).colwise().norm().minCoeff();
  const double stray = (local->map(place) - corners_.at(id).point.pixel).norm();
  return stray > std::max(kLeastOutlierPx, kOutlierOfSquare * square_px);
}

void CornerLattice::drop_outliers() {
  std::vector<int> outliers;
  for (const auto& [id, corner] : corners_) {
    if (is_outlier(id)) outliers.push_back(id);
  }
  // One bad corner makes its neighbours look bad: keep those that are good without it.
  auto all = corners_;
  for (const int id : outliers) corners_.erase(id);
  for (const int id : outliers) {
    corners_.insert(*all.find(id));
    if (!determine_a_homography(neighbours(id)) || is_outlier(id)) corners_.erase(id);
  }
}

void CornerLattice::grow() {
  for (bool found = true; found;) {
    found = false;
    for (int id = 0; id < columns() * rows(); ++id) {
      if (corners_.contains(id)) continue;
      const auto ties = neighbours(id);
      if (!determine_a_homography(ties)) continue;
      const auto local = fit_homography(ties);
      if (!local || !look_for(id, *local)) continue;
      if (is_outlier(id)) {
        corners_.erase(id);
      } else {
        found = true;
      }
    }
  }
}

std::vector<MeasuredPoint> CornerLattice::corners() const {
  std::vector<MeasuredPoint> all;
  for (const auto& [id, corner] : corners_) all.push_back(corner);
  return all;
}

}  // namespace slsd
