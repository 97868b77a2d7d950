// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/board/board.hpp"
#include "core/board/find_board.hpp"
#include "core/geometry/calibration.hpp"
#include "core/result.hpp"

namespace slsd {

/// Place of a board in a scanner's cloud: the corners' rays, intersected with the plane of the cloud on the board. The
/// print's scale has no effect, and the matched data is the same that will be merged.
struct CloudView {
  struct Corner {
    int id = 0;                ///< id as in Board::point()
    Eigen::Vector3d point_mm;  ///< place in the scanner's frame
  };
  std::size_t scanner = 0;
  std::vector<Corner> corners;
  Eigen::Vector3d normal;         ///< normal of the plane, away from the scanner
  Eigen::Vector3d along, across;  ///< perpendicular axes in the plane
  Eigen::Vector3d middle_mm;
  /// Covariance of the plane's offset along its normal at its centre, mm, and of its slopes along and across.
  Eigen::Matrix3d covariance;
  double bend_mm = 0;        ///< root mean square distance of the cloud's parts from their plane
  double scale_percent = 0;  ///< excess of the board's size in the cloud over the stated size, per cent
};

/// @param cloud  cloud of one camera, in its frame, mm
/// @param lens   lens of that camera
/// @errors kNotFound: too few points of the cloud are on the board; kMismatch: these points are not flat
/// @thread reentrant
[[nodiscard]] Result<CloudView> view_in_cloud(std::span<const Eigen::Vector3d> cloud, const BoardSighting& sighting,
                                              const Board& board, const Lens& lens);

struct PlacedScanner {
  RigidTransform first_from_scanner;
  std::size_t places = 0;   ///< number of the board's places that it saw together with another scanner
  double sigma_mm = 0;      ///< one standard deviation of a point at the centre of these places
  double sigma_far_mm = 0;  ///< the same at the worst corner of the board
};

struct PlacedScanners {
  std::vector<PlacedScanner> scanners;  ///< the first one's frame is the common frame
  std::vector<double> off_mm;  ///< for each place: root mean square distance of its corners from their means; 0: not
                               ///< used
};

/// Places several scanners by a board that at least two of them saw at each place.
/// @param places  for each place, the scanners' views of the same board
/// @param names   names of the scanners
/// @errors kNotFound: a scanner shares no place with those connected to the first
/// @thread reentrant
[[nodiscard]] Result<PlacedScanners> place_scanners(const std::vector<std::vector<CloudView>>& places,
                                                    const std::vector<std::string>& names);

}  // namespace slsd
