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

/// Place of a board in a scanner's cloud: the corners' rays, ended by the plane of the cloud on it. A scale of the
/// print has no part in it, and the matched data is the data that will be merged.
struct CloudLook {
  struct Corner {
    int id = 0;                ///< id as in Board::point()
    Eigen::Vector3d point_mm;  ///< place in the scanner's frame
  };
  std::size_t scanner = 0;
  std::vector<Corner> corners;
  Eigen::Vector3d normal;         ///< normal of the plane, away from the scanner
  Eigen::Vector3d along, across;  ///< axes in the plane, at right angles
  Eigen::Vector3d middle_mm;
  /// Covariance of the plane's offset along its normal at its middle, mm, and of its slopes along and across.
  Eigen::Matrix3d covariance;
  double bend_mm = 0;        ///< root mean square of the cloud's parts off their plane
  double scale_percent = 0;  ///< excess of the board's size in the cloud over the stated size
};

/// @param cloud  of one camera, in its frame, mm
/// @param lens   of that camera
/// @errors kNotFound: too few points of the cloud are on the board; kMismatch: they are not flat
/// @thread reentrant
[[nodiscard]] Result<CloudLook> look_in_cloud(std::span<const Eigen::Vector3d> cloud, const BoardSighting& sighting,
                                              const Board& board, const Lens& lens);

struct PlacedScanner {
  RigidTransform first_from_scanner;
  std::size_t places = 0;   ///< number of the board's places that it saw together with another
  double sigma_mm = 0;      ///< one standard deviation of where a point in the middle of these is put
  double sigma_far_mm = 0;  ///< the same at the board's corner that is worst
};

struct PlacedScanners {
  std::vector<PlacedScanner> scanners;  ///< the first is the frame of all
  std::vector<double> off_mm;  ///< place by place: root mean square of its corners off their means; 0: not used
};

/// Places several scanners, from a board that two or more of them saw at each place.
/// @param places  looks at the same board at the same place, one a scanner
/// @param names   of the scanners
/// @errors kNotFound: a scanner shares no place with those that reach the first
/// @thread reentrant
[[nodiscard]] Result<PlacedScanners> place_scanners(const std::vector<std::vector<CloudLook>>& places,
                                                    const std::vector<std::string>& names);

}  // namespace slsd
