// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/solve/place_scanners.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <random>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "core/board/tie.hpp"
#include "core/geometry/plane_fit.hpp"

namespace slsd {
namespace {

constexpr int kPartsAcross = 5, kPartsDown = 4;
constexpr int kPartsMin = 10;
constexpr int kPointsOfAPart = 4;
constexpr std::size_t kPointsMax = 20'000;  // largest number of a dense cloud's points for fitting the plane
constexpr double kBendMax = 5e-4;           // share of the distance
constexpr std::size_t kSharedMin = 4;
constexpr int kRounds = 200;
constexpr double kSettledMm = 1e-6;
constexpr double kNothingMm2 = 1e-12;
constexpr int kDraws = 200;

using Places = std::vector<std::vector<CloudView>>;

/// A scanner's corners, paired with the places of the same corners in the other scanners.
struct Pairs {
  std::vector<Eigen::Vector3d> from, to;

  [[nodiscard]] RigidTransform fit() const {
    const auto columns = [](const std::vector<Eigen::Vector3d>& points) {
      return Eigen::Map<const Eigen::Matrix3Xd>(points.data()->data(), 3, static_cast<Eigen::Index>(points.size()));
    };
    const Eigen::Matrix4d moved = Eigen::umeyama(columns(from), columns(to), /*with_scaling=*/false);
    return {moved.topLeftCorner<3, 3>(), moved.topRightCorner<3, 1>()};
  }
};

using Poses = std::vector<std::optional<RigidTransform>>;

// Pairs a scanner's corners with the means of their places in the scanners that are already placed.
Pairs pairs_of(std::size_t scanner, const Places& places, const Poses& poses) {
  Pairs pairs;
  for (const auto& views : places) {
    std::map<int, std::pair<Eigen::Vector3d, int>> others;
    for (const CloudView& view : views) {
      if (view.scanner == scanner || !poses[view.scanner]) continue;
      for (const auto& corner : view.corners) {
        auto& [sum, count] = others.try_emplace(corner.id, Eigen::Vector3d::Zero(), 0).first->second;
        sum += *poses[view.scanner] * corner.point_mm;
        ++count;
      }
    }
    for (const CloudView& view : views) {
      if (view.scanner != scanner) continue;
      for (const auto& corner : view.corners) {
        const auto other = others.find(corner.id);
        if (other == others.end()) continue;
        pairs.from.push_back(corner.point_mm);
        pairs.to.emplace_back(other->second.first / other->second.second);
      }
    }
  }
  return pairs;
}

// Starting from the first scanner, continue with the one that shares most corners.
Poses solve(const Places& places, std::size_t scanners, const Poses& begin) {
  Poses poses = begin;
  poses[0] = RigidTransform();
  while (true) {
    std::size_t next = 0;
    Pairs most;
    for (std::size_t i = 1; i < scanners; ++i) {
      if (poses[i]) continue;
      if (Pairs pairs = pairs_of(i, places, poses); pairs.from.size() > most.from.size()) next = i, most = pairs;
    }
    if (most.from.size() < kSharedMin) break;
    poses[next] = most.fit();
  }
  for (int round = 0; round < kRounds; ++round) {
    double moved_mm = 0;
    for (std::size_t i = 1; i < scanners; ++i) {
      if (!poses[i]) continue;
      const Pairs pairs = pairs_of(i, places, poses);
      const RigidTransform now = pairs.fit();
      for (const auto& point : pairs.from) moved_mm = std::max(moved_mm, (now * point - *poses[i] * point).norm());
      poses[i] = now;
    }
    if (moved_mm < kSettledMm) break;
  }
  return poses;
}

/// Squared distances of corners from the means of all scanners, with their degrees of freedom.
struct Residuals {
  double in_plane = 0, off_plane = 0, freedom = 0;
  std::vector<double> place_mm;
};

Residuals residuals_of(const Places& places, const Poses& poses) {
  Residuals all;
  for (const auto& views : places) {
    std::map<int, std::vector<Eigen::Vector3d>> seen;
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    for (const CloudView& view : views) {
      if (!poses[view.scanner]) continue;
      normal = poses[view.scanner]->rotation * view.normal;
      for (const auto& corner : view.corners) seen[corner.id].push_back(*poses[view.scanner] * corner.point_mm);
    }
    double squares = 0;
    std::size_t count = 0;
    for (const auto& [id, points] : seen) {
      if (points.size() < 2) continue;
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      for (const auto& point : points) mean += point / static_cast<double>(points.size());
      for (const auto& point : points) {
        const double off = normal.dot(point - mean), square = (point - mean).squaredNorm();
        all.off_plane += off * off;
        all.in_plane += square - off * off;
        squares += square;
        ++count;
      }
      all.freedom += static_cast<double>(points.size() - 1);
    }
    all.place_mm.push_back(count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0);
  }
  return all;
}

// The same views with their disagreement removed.
Places agreeing(Places places, const Poses& poses) {
  for (auto& views : places) {
    std::map<int, std::pair<Eigen::Vector3d, int>> sums;
    for (const CloudView& view : views) {
      for (const auto& [id, point] : view.corners) {
        auto& [sum, count] = sums.try_emplace(id, Eigen::Vector3d::Zero(), 0).first->second;
        sum += *poses[view.scanner] * point;
        ++count;
      }
    }
    for (CloudView& view : views) {
      const RigidTransform scanner_from_first = poses[view.scanner]->inverse();
      for (auto& [id, point] : view.corners) point = scanner_from_first * (sums[id].first / sums[id].second);
    }
  }
  return places;
}

// The same views with simulated errors of realistic size.
Places with_errors(Places places, double corner_mm, std::mt19937& random) {
  std::normal_distribution<double> normal;
  const auto draw = [&] { return normal(random); };
  for (auto& views : places) {
    for (CloudView& view : views) {
      const Eigen::Matrix3d root = view.covariance.llt().matrixL();
      const Eigen::Vector3d off = root * Eigen::Vector3d(draw(), draw(), draw());
      for (auto& [id, point] : view.corners) {
        const Eigen::Vector3d from_middle = point - view.middle_mm;
        const double off_mm = off[0] + off[1] * view.along.dot(from_middle) + off[2] * view.across.dot(from_middle);
        point *= 1 + off_mm / view.normal.dot(point);  // along the ray
        point += corner_mm * (draw() * view.along + draw() * view.across);
      }
    }
  }
  return places;
}

void estimate_sigmas(const Places& places, const Poses& poses, const Residuals& found, PlacedScanners& placed) {
  struct Scatter {
    std::vector<Eigen::Vector3d> points;  ///< the centre first
    std::vector<double> squares;
  };
  std::vector<Scatter> scatters(placed.scanners.size());
  for (const auto& views : places) {
    for (const CloudView& view : views) {
      for (const auto& corner : view.corners) scatters[view.scanner].points.push_back(corner.point_mm);
    }
  }
  for (Scatter& scatter : scatters) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const auto& point : scatter.points) middle += point / static_cast<double>(scatter.points.size());
    scatter.points.insert(scatter.points.begin(), middle);
    scatter.squares.assign(scatter.points.size(), 0);
  }
  const double corner_mm = std::sqrt(found.in_plane / (2 * std::max(1.0, found.freedom)));
  const Places exact = agreeing(places, poses);
  std::mt19937 random(1);
  double expected_off_plane = 0;
  for (int i = 0; i < kDraws; ++i) {
    const Places other = with_errors(exact, corner_mm, random);
    const Poses moved = solve(other, scatters.size(), poses);
    expected_off_plane += residuals_of(other, moved).off_plane / kDraws;
    for (std::size_t s = 1; s < scatters.size(); ++s) {
      for (std::size_t p = 0; p < scatters[s].points.size(); ++p) {
        const Eigen::Vector3d& point = scatters[s].points[p];
        scatters[s].squares[p] += (*moved[s] * point - *poses[s] * point).squaredNorm() / kDraws;
      }
    }
  }
  // Planes that agree less than their own points predict have further errors.
  const double worse =
      expected_off_plane > kNothingMm2 ? std::max(1.0, std::sqrt(found.off_plane / expected_off_plane)) : 1.0;
  for (std::size_t s = 1; s < scatters.size(); ++s) {
    const std::vector<double>& squares = scatters[s].squares;
    placed.scanners[s].sigma_mm = worse * std::sqrt(squares.front());
    placed.scanners[s].sigma_far_mm = worse * std::sqrt(*std::ranges::max_element(squares));
  }
}

}  // namespace

Result<CloudView> view_in_cloud(std::span<const Eigen::Vector3d> cloud, const BoardSighting& sighting,
                                const Board& board, const Lens& lens) {
  std::vector<Tie> ties;  // points of the board, and directions without the lens's distortion
  for (const SeenPoint& point : sighting.points)
    ties.push_back({board.point(point.id).head<2>(), lens.undistort(point.pixel)});
  const auto direction_of_board = fit_homography(ties);
  if (!direction_of_board) return fail(ErrorCode::kNotFound, "the board's points do not span a plane");
  const Homography board_of_direction = direction_of_board->inverse();
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> places;
  const double width = board.width_mm(), height = board.height_mm();
  for (const Eigen::Vector3d& point : cloud) {
    const Eigen::Vector2d at = board_of_direction.map(point.hnormalized());
    if (!(at.x() > 0 && at.x() < width && at.y() > 0 && at.y() < height)) continue;
    points.push_back(point);
    places.push_back(at);
  }
  const std::size_t step = points.size() / kPointsMax + 1;
  for (std::size_t i = 0; i * step < points.size(); ++i) points[i] = points[i * step], places[i] = places[i * step];
  points.resize((points.size() + step - 1) / step);
  const auto plane = fit_plane(points);
  if (!plane)
    return fail(ErrorCode::kNotFound, "the cloud has no points on the board: move it into the projector's light");

  CloudView view;
  view.normal = plane->normal;
  view.middle_mm = plane->middle;
  view.along = plane->normal.unitOrthogonal();
  view.across = plane->normal.cross(view.along);
  // An error common to a part of the board is no noise of its points: the scatter of the parts shows how well the plane
  // is known.
  std::map<int, std::pair<Eigen::Vector4d, int>> parts;
  for (const std::size_t i : plane->on_plane) {
    const int part = static_cast<int>(places[i].x() / width * kPartsAcross) +
                     kPartsAcross * static_cast<int>(places[i].y() / height * kPartsDown);
    auto& [sum, count] = parts.try_emplace(part, Eigen::Vector4d::Zero(), 0).first->second;
    const Eigen::Vector3d from_middle = points[i] - plane->middle;
    sum += Eigen::Vector4d(1, view.along.dot(from_middle), view.across.dot(from_middle), plane->off_mm(points[i]));
    ++count;
  }
  std::erase_if(parts, [](const auto& part) { return part.second.second < kPointsOfAPart; });
  const auto part_count = static_cast<double>(parts.size());
  if (parts.size() < kPartsMin) {
    return fail(ErrorCode::kNotFound, "the cloud covers too little of the board: " + std::to_string(parts.size()) +
                                          " of " + std::to_string(kPartsAcross * kPartsDown) +
                                          " parts; move it to the middle of the light");
  }
  Eigen::Matrix3d design = Eigen::Matrix3d::Zero();
  double squares = 0;
  for (const auto& [part, sum_and_count] : parts) {
    const Eigen::Vector4d mean = sum_and_count.first / sum_and_count.second;
    design += mean.head<3>() * mean.head<3>().transpose();
    squares += mean[3] * mean[3];
  }
  view.bend_mm = std::sqrt(squares / part_count);
  view.covariance = squares / (part_count - 3) * design.inverse();
  if (const double most_mm = kBendMax * plane->middle.norm(); view.bend_mm > most_mm) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "the board is not flat in the cloud: its parts are %.2f mm off a plane (at most %.2f); use a stiff "
                  "one, or calibrate this scanner again",
                  view.bend_mm, most_mm);
    return fail(ErrorCode::kMismatch, text);
  }
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), mean_on_board = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < ties.size(); ++i) {
    view.corners.push_back({sighting.points[i].id, plane->meet(ties[i].pixel)});
    mean += view.corners[i].point_mm / static_cast<double>(ties.size());
    mean_on_board += board.point(sighting.points[i].id) / static_cast<double>(ties.size());
  }
  double measured = 0, said = 0;
  for (const auto& [id, point] : view.corners) {
    measured += (point - mean).squaredNorm();
    said += (board.point(id) - mean_on_board).squaredNorm();
  }
  view.scale_percent = 100 * (std::sqrt(measured / said) - 1);
  return view;
}

Result<PlacedScanners> place_scanners(const Places& places, const std::vector<std::string>& names) {
  const std::size_t scanners = names.size();
  const Poses poses = solve(places, scanners, Poses(scanners));
  PlacedScanners placed;
  placed.scanners.resize(scanners);
  for (std::size_t i = 0; i < scanners; ++i) {
    if (!poses[i]) {
      return fail(
          ErrorCode::kNotFound,
          "shares no place of the board with the first scanner, directly or through others: show the board to both",
          names[i]);
    }
    placed.scanners[i].first_from_scanner = *poses[i];
    placed.scanners[i].places = static_cast<std::size_t>(std::ranges::count_if(places, [&](const auto& views) {
      return views.size() > 1 && std::ranges::find(views, i, &CloudView::scanner) != views.end();
    }));
  }
  const Residuals found = residuals_of(places, poses);
  placed.off_mm = found.place_mm;
  estimate_sigmas(places, poses, found, placed);
  return placed;
}

}  // namespace slsd
