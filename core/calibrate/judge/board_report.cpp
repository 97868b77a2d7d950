// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/judge/board_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "core/calibrate/solve/point_residuals.hpp"

namespace slsd {
namespace {

constexpr double kBentSigmas = 5;
constexpr double kBentShare = 3e-4;     // share of the size: 0.1 mm of A4
constexpr double kFarBentShare = 6e-3;  // with a larger bend, a print is no longer a smooth surface
constexpr double kKnownShare = 1e-3;    // share of the size: a larger deviation makes the result meaningless
constexpr double kUnevenTimes = 5, kUnevenShare = 3e-5;
constexpr char kMount[] = "mount the print on glass or an aluminium composite plate";

constexpr int kPlacesAcross = 8, kPlacesDown = 6;
constexpr std::size_t kPosesOfPlace = 4;  // the scatter of fewer poses is weak evidence

/// The lowest and the highest height of a shape.
struct Extremes {
  Eigen::Vector2d lowest, highest;
};

Extremes extremes_of(const BoardShape& shape, const Eigen::AlignedBox2d& sheet) {
  constexpr int kSteps = 24;
  Extremes extremes{sheet.min(), sheet.min()};
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const Eigen::Vector2d at = sheet.min() + Eigen::Vector2d(i, j).cwiseProduct(sheet.sizes()) / kSteps;
      if (shape.height_mm(at) < shape.height_mm(extremes.lowest)) extremes.lowest = at;
      if (shape.height_mm(at) > shape.height_mm(extremes.highest)) extremes.highest = at;
    }
  }
  return extremes;
}

/// Heights of a place in one pose: their weighted sum, and the sum of the weights.
struct Heights {
  double sum = 0, weight = 0;
};
using HeightMap = std::array<Heights, kPlacesAcross * kPlacesDown>;

/// Divides a residual by its change as the board rises: the height that would explain where the point was seen.
void add_height(const Eigen::Vector2d& residual, const Eigen::Vector2d& raised, double sigma_px, Heights& heights) {
  const Eigen::Vector2d slope = (raised - residual) / sigma_px;
  heights.sum -= slope.dot(residual) / sigma_px;
  heights.weight += slope.squaredNorm();
}

/// Root mean square of a view's residuals, without outlying points.
template <class Point>
double rms_of(const std::vector<Point>& points, std::vector<Eigen::Vector2d> residuals) {
  std::size_t i = 0;
  std::erase_if(residuals, [&](const Eigen::Vector2d&) { return points[i++].outlying; });
  return rms_px(residuals);
}

/// Measures the height of each place of the board above the fitted shape.
HeightMap heights_of(const PoseObservation& pose, const RigModel& rig, const MotionVector& rig_from_board,
                     const Eigen::AlignedBox2d& sheet) {
  const RigidTransform place = to_motion(rig_from_board);
  RigidTransform raised = place;
  raised.translation += place.rotation.col(2);  // by 1 mm
  HeightMap map;
  const auto at = [&](const Eigen::Vector2d& board_mm) -> Heights& {
    const Eigen::Vector2d share = (board_mm - sheet.min()).cwiseQuotient(sheet.sizes());
    const int column = std::clamp(static_cast<int>(share.x() * kPlacesAcross), 0, kPlacesAcross - 1);
    const int row = std::clamp(static_cast<int>(share.y() * kPlacesDown), 0, kPlacesDown - 1);
    return map[static_cast<std::size_t>(row * kPlacesAcross + column)];
  };
  for (const PoseView& view : pose.views) {
    const ViewResiduals residuals = residuals_of(view, rig, rig_from_board, pose.subject),
                        after = residuals_of(view, rig, to_vector(raised), pose.subject);
    const double corner_sigma_px = std::max(rms_of(view.corners, residuals.corners_px), 1e-3),
                 symbol_sigma_px = std::max(rms_of(view.symbols, residuals.symbols_px), 1e-3);
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      if (view.corners[i].outlying) continue;
      add_height(residuals.corners_px[i], after.corners_px[i], corner_sigma_px, at(view.corners[i].board_mm));
    }
    for (std::size_t i = 0; i < view.symbols.size(); ++i) {
      if (view.symbols[i].outlying) continue;
      const auto seen = rig.meet(rig.cameras[view.camera], place, view.symbols[i].camera_px, pose.subject);
      if (!seen || !after.symbols_px[i].allFinite()) continue;
      add_height(residuals.symbols_px[i], after.symbols_px[i], symbol_sigma_px,
                 at((place.inverse() * *seen).head<2>()));
    }
  }
  return map;
}

/// Compares the mean height of a place over all poses with its scatter over the poses, which measures chance for any
/// kind of noise.
void judge_relief(const Observations& observations, const RigModel& rig, BoardReport& board) {
  std::vector<HeightMap> poses;
  for (std::size_t i = 0; i < observations.poses.size(); ++i) {
    if (observations.poses[i].subject != PoseSubject::kBoard) continue;
    poses.push_back(heights_of(observations.poses[i], rig, rig.rig_from_board[i], board.sheet_mm));
  }
  double squares = 0, chance = 0, places = 0;
  for (std::size_t place = 0; place < HeightMap().size(); ++place) {
    std::vector<double> heights;
    for (const HeightMap& pose : poses) {
      if (pose[place].weight > 0) heights.push_back(pose[place].sum / pose[place].weight);
    }
    if (heights.size() < kPosesOfPlace) continue;
    const auto count = static_cast<double>(heights.size());
    double mean = 0, scatter = 0;
    for (const double height : heights) mean += height / count;
    for (const double height : heights) scatter += (height - mean) * (height - mean) / (count - 1);
    squares += mean * mean, chance += scatter / count, places += 1;
  }
  if (places < 1 || !(chance > 0)) return;
  board.uneven_times = squares / chance;
  board.uneven_mm = std::sqrt(std::max(squares - chance, 0.0) / places);
}

}  // namespace

bool BoardReport::is_bent() const {
  return bend_mm > std::max(kBentSigmas * bend_sigma_mm, kBentShare * size_mm());
}

bool BoardReport::is_known() const {
  return bend_sigma_mm <= kKnownShare * size_mm();
}

bool BoardReport::is_uneven() const {
  return uneven_times > kUnevenTimes && uneven_mm > kUnevenShare * size_mm();
}

Eigen::AlignedBox2d seen_of_board(const Observations& observations) {
  Eigen::AlignedBox2d box;
  for (const PoseObservation& pose : observations.poses) {
    if (pose.subject != PoseSubject::kBoard) continue;
    for (const PoseView& view : pose.views) {
      for (const BoardPoint& corner : view.corners) box.extend(corner.board_mm);
    }
  }
  return box;
}

BoardReport judge_board(const Observations& observations, const RigModel& rig,
                        const std::vector<SharedParameter>& shared, const PoseInfluence& influence,
                        const Eigen::AlignedBox2d& sheet_mm) {
  BoardReport board{.sheet_mm = sheet_mm, .shape = rig.shape};
  if (sheet_mm.isEmpty()) return board;
  const Extremes extremes = extremes_of(rig.shape, sheet_mm);
  const ShapeAt lowest = shape_at(rig.shape.terms_mm.data(), rig.shape.frame, extremes.lowest),
                highest = shape_at(rig.shape.terms_mm.data(), rig.shape.frame, extremes.highest);
  board.bend_mm = highest.height_mm - lowest.height_mm;
  const auto first = std::ranges::find(shared, SharedParameter::Kind::kShape, &SharedParameter::kind);
  if (first != shared.end()) {
    constexpr auto kTerms = static_cast<int>(kShapeTerms);
    const Eigen::Index at = first - shared.begin();
    const Eigen::Matrix<double, 1, kTerms> slope = highest.by_term - lowest.by_term;
    board.bend_sigma_mm = std::sqrt((slope * influence.covariance.block<kTerms, kTerms>(at, at)).dot(slope));
  }
  judge_relief(observations, rig, board);
  return board;
}

std::string bend_text(const BoardReport& board) {
  return fmt::format("bent by {:.2f} +- {:.2f} mm over its {:.0f} mm", board.bend_mm, board.bend_sigma_mm,
                     board.size_mm());
}

std::string board_text(const BoardReport& board) {
  if (board.is_bent()) return bend_text(board) + " in all poses alike; the calibration corrects for it";
  return fmt::format("flat, as far as the poses show: {}", bend_text(board));
}

std::vector<std::string> board_warnings(const BoardReport& board) {
  std::vector<std::string> warnings;
  if (!board.is_known()) {
    warnings.push_back(
        fmt::format("the poses do not show whether the board is flat: it is {}. Tilt it by 20 to 40 degrees to all "
                    "sides, in more poses, or {}",
                    bend_text(board), kMount));
  } else if (board.is_bent() && board.bend_mm > kFarBentShare * board.size_mm()) {
    warnings.push_back(fmt::format(
        "the board is {}. The calibration corrects for it, but such a print may change its shape between poses: {}",
        bend_text(board), kMount));
  }
  if (board.is_uneven()) {
    warnings.push_back(
        fmt::format("the board is uneven by {:.2f} mm (RMS) in all poses alike, which distorts the calibration: {}",
                    board.uneven_mm, kMount));
  }
  return warnings;
}

}  // namespace slsd
