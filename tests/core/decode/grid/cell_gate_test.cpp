// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/grid/cell_gate.hpp"

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "tests/core/decode/grid/simulated_grid.hpp"
#include "tests/core/decode/shipped_pattern.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

using Cell = std::pair<int, int>;

/// A camera beside the projector in a direction of its own: so its epipolar lines are tilted in the pattern.
class CellGateOfATiltedLine : public testing::TestWithParam<int> {
 protected:
  CellGateOfATiltedLine()
      : pattern_(shipped_pattern("16px-5.toml")), cells_(pattern_, flat_prototypes(), paper_rig().projector) {
    const double angle = GetParam() * std::numbers::pi / 180;
    rig_.cameras[0].projector_from_camera.rotation.setIdentity();
    rig_.cameras[0].projector_from_camera.translation = 180 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
  }

  [[nodiscard]] std::vector<EpipolarSegment> line_of(const Cell& cell, double depth_min_mm, double depth_max_mm) const {
    const RigidTransform& to_projector = rig_.cameras[0].projector_from_camera;
    const Eigen::Vector3d point = 2000 * cells_.ray(cell.first, cell.second).direction.homogeneous();
    return {EpipolarGate(rig_.cameras[0], rig_.projector, depth_min_mm, depth_max_mm)
                .prepare((to_projector.rotation.transpose() * (point - to_projector.translation)).hnormalized())};
  }

  Pattern pattern_;
  CellRays cells_;
  Calibration rig_ = paper_rig();
};

// Followed, as found by looking at all of them, wherever on the line the working depth begins and ends.
TEST_P(CellGateOfATiltedLine, VisitsAllCellsOnIt) {
  constexpr double kTolerancePx = 1.5;
  std::size_t all = 0;
  struct Searched {
    Cell from;
    double depth_min_mm, depth_max_mm;
  };
  for (const auto& [from, depth_min_mm, depth_max_mm] :
       {Searched{{22, 35}, 350, 3200}, Searched{{0, 0}, 350, 3200}, Searched{{43, 70}, 350, 3200},
        Searched{{5, 66}, 350, 3200}, Searched{{40, 12}, 350, 3200}, Searched{{22, 35}, 1990, 2010},
        Searched{{22, 60}, 1500, 2100}, Searched{{40, 12}, 1900, 2600}}) {
    const auto segments = line_of(from, depth_min_mm, depth_max_mm);
    const CellGate gate(cells_, segments, kTolerancePx);
    std::vector<Cell> along, admitted;
    gate.visit_along(0, 0, [&](int row, int column) { along.emplace_back(row, column); });
    for (int row = 0; row < cells_.rows(); ++row)
      for (int column = 0; column < cells_.columns(); ++column)
        if (gate.admits(0, row, column)) admitted.emplace_back(row, column);
    EXPECT_THAT(along, testing::UnorderedElementsAreArray(admitted)) << from.first << ", " << from.second;
    all += admitted.size();
  }
  EXPECT_GT(all, 5U);
}

INSTANTIATE_TEST_SUITE_P(Degrees, CellGateOfATiltedLine, testing::Values(0, 7, 30, 44, 46, 80, 90, 100, 135, 170, 180));

}  // namespace
}  // namespace slsd
