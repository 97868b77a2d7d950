// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/judge/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace slsd {
namespace {

constexpr int kParts = 3;  // named regions of the image, along each axis

int cell(double position, int length_px, int cells) {
  return std::clamp(static_cast<int>((position + 0.5) / length_px * cells), 0, cells - 1);
}

}  // namespace

void Coverage::add(const Eigen::Vector2d& pixel, const ImageSize& size) {
  const int column = cell(pixel.x(), size.width_px, kCoverageColumns),
            row = cell(pixel.y(), size.height_px, kCoverageRows);
  ++counts[static_cast<std::size_t>(row * kCoverageColumns + column)];
}

double Coverage::share() const {
  const auto filled = std::ranges::count_if(counts, [](int count) { return count > 0; });
  return static_cast<double>(filled) / static_cast<double>(counts.size());
}

std::string Coverage::emptiest() const {
  static constexpr const char* kNames[kParts][kParts] = {{"the upper left", "the top", "the upper right"},
                                                         {"the left", "the middle", "the right"},
                                                         {"the lower left", "the bottom", "the lower right"}};
  double empty[kParts][kParts] = {}, cells[kParts][kParts] = {};
  for (int row = 0; row < kCoverageRows; ++row) {
    for (int column = 0; column < kCoverageColumns; ++column) {
      const int part_row = row * kParts / kCoverageRows, part_column = column * kParts / kCoverageColumns;
      cells[part_row][part_column] += 1;
      empty[part_row][part_column] += counts[static_cast<std::size_t>(row * kCoverageColumns + column)] == 0 ? 1 : 0;
    }
  }
  std::string name;
  double most = 0;
  for (int row = 0; row < kParts; ++row) {
    for (int column = 0; column < kParts; ++column) {
      const double share = empty[row][column] / cells[row][column];
      if (share > most) most = share, name = kNames[row][column];
    }
  }
  return name;
}

Coverage camera_coverage(const Observations& observations, std::size_t camera) {
  Coverage coverage;
  for (const PoseObservation& pose : observations.poses) {
    for (const PoseView& view : pose.views) {
      if (view.camera != camera) continue;
      for (const BoardPoint& corner : view.corners) coverage.add(corner.camera_px, observations.cameras[camera].size);
      for (const ProjectedPoint& symbol : view.symbols) {
        if (!symbol.outlying) coverage.add(symbol.camera_px, observations.cameras[camera].size);
      }
    }
  }
  return coverage;
}

Coverage projector_coverage(const Observations& observations) {
  Coverage coverage;
  for (const PoseObservation& pose : observations.poses) {
    for (const PoseView& view : pose.views) {
      for (const ProjectedPoint& symbol : view.symbols) {
        if (!symbol.outlying) coverage.add(symbol.projector_px, observations.projector);
      }
    }
  }
  return coverage;
}

std::vector<double> tilts_deg(const RigModel& rig) {
  std::vector<double> tilts;
  for (const MotionVector& pose : rig.rig_from_board) {
    const double cosine = std::abs(to_motion(pose).rotation(2, 2));
    tilts.push_back(std::acos(std::min(cosine, 1.0)) * 180 / std::numbers::pi);
  }
  return tilts;
}

std::vector<double> distances_mm(const RigModel& rig) {
  std::vector<double> distances;
  for (const MotionVector& pose : rig.rig_from_board) distances.push_back(pose[5]);
  return distances;
}

}  // namespace slsd
