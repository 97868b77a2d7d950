// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "core/decode/grid/decode_windows.hpp"
#include "tests/core/decode/alone.hpp"
#include "tests/core/decode/grid/simulated_grid.hpp"
#include "tests/core/decode/shipped_pattern.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd::test {

/// Nodes at places of a grid, linked wherever there are two side by side, that show what they are told to.
class ShownIslands : public testing::Test {
 protected:
  static constexpr double kSure = 0.992;  // a shape of its letter

  ShownIslands()
      : pattern_(shipped_pattern("16px-5.toml")), cells_(pattern_, flat_prototypes(), paper_rig().projector) {}

  void show(int row, int column, int letter) {
    grid_.add(row, column, {18.F * static_cast<float>(column), 18.F * static_cast<float>(row)},
              LatticeFrame::Identity());
    shapes_.push_back(read_as(letter, 5, kSure));
  }
  void show_pattern(int top, int left, int bottom, int right, int slid = 0) {
    for (int row = top; row < bottom; ++row)
      for (int column = left; column < right; ++column) show(row, column, pattern_.array.at(row, column + slid));
  }

  /// The line of each node's pixel, were the cells at one depth, those of a row as many columns on as it is slid.
  std::vector<EpipolarSegment> lines_through(double depth_mm, const std::function<int(int)>& slid) const {
    const Calibration rig = paper_rig();
    const RigidTransform& to_projector = rig.cameras[0].projector_from_camera;
    const EpipolarGate gate(rig.cameras[0], rig.projector, 350, 3200);
    std::vector<EpipolarSegment> segments;
    for (const auto& [row, column] : grid_.cells) {
      const Eigen::Vector3d point = depth_mm * cells_.ray(row, column + slid(row)).direction.homogeneous();
      const Eigen::Vector3d seen = to_projector.rotation.transpose() * (point - to_projector.translation);
      segments.push_back(gate.prepare(seen.hnormalized()));
    }
    return segments;
  }
  /// The line of what is seen so far below a cell's middle, projector px.
  EpipolarSegment line_below(int row, int column, double off_px) const {
    const Calibration rig = paper_rig();
    const RigidTransform& to_projector = rig.cameras[0].projector_from_camera;
    const Eigen::Vector2d pixel = cells_.pixel(row, column) + Eigen::Vector2d(0, off_px);
    const Eigen::Vector3d point = 2000 * rig.projector.undistort(pixel).homogeneous();
    return EpipolarGate(rig.cameras[0], rig.projector, 350, 3200)
        .prepare((to_projector.rotation.transpose() * (point - to_projector.translation)).hnormalized());
  }
  std::vector<CellClaim> decode(std::span<const EpipolarSegment> segments = {}) {
    grid_.link_truly();
    WindowDecoder decoder(pattern_, std::make_shared<const Codebook>(pattern_.array, kWholeRows, kWholeColumns),
                          kWrongCellsMax);
    std::vector<CellClaim> claims;
    decoder.decode(grid_.nodes, shapes_, CellGate(cells_, segments, 1.5), alone, claims);
    return claims;
  }
  int decoded(const std::vector<CellClaim>& claims) const {
    return static_cast<int>(std::ranges::count(claims, RegionStatus::kDecoded, &CellClaim::status));
  }
  bool is_decoded(const std::vector<CellClaim>& claims, int row, int column) const {
    return claims[grid_.node_at(row, column)].status == RegionStatus::kDecoded;
  }

  Pattern pattern_;
  CellRays cells_;
  SimulatedGrid grid_;
  std::vector<Classification> shapes_;
};

}  // namespace slsd::test
