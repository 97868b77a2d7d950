// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/corpus/score.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "core/decode/decoder.hpp"

namespace slsd {

namespace {

using Cell = std::pair<int, int>;

const CellTruth* find(const std::vector<CellTruth>& truth, const CloudPoint& point) {
  for (const CellTruth& cell : truth)
    if (cell.column == point.column && cell.row == point.row) return &cell;
  return nullptr;
}

/// Adds a point's error at the pixel where the camera sees it.
void add_depth_error(const CloudPoint& point, const Lens& camera, const SurfaceTruth& surface, Score& score) {
  const Eigen::Vector3d position(point.x, point.y, point.z);
  const double error_mm = point.z - surface.depth_mm(camera.project(position));
  ++score.measured;
  score.depth_rms_mm += error_mm * error_mm;
  score.depth_bias_mm += error_mm;
  score.depth_worst_mm = std::max(score.depth_worst_mm, std::abs(error_mm));
}

}  // namespace

Score score(const Scene& scene, const std::vector<CloudPoint>& points) {
  Score score;
  for (const CellTruth& cell : scene.truth) score.resolvable += cell.resolvable ? 1 : 0;
  std::set<Cell> taken;
  for (const CloudPoint& point : points) {
    const CellTruth* cell = find(scene.truth, point);
    const bool first = taken.emplace(point.column, point.row).second;
    if (cell == nullptr || !first || !cell->covers({point.camera_u, point.camera_v})) {
      score.wrong.push_back(point);
      continue;
    }
    score.decoded += cell->resolvable ? 1 : 0;
    if (cell->surface) add_depth_error(point, scene.calibration.cameras.front().lens, *cell->surface, score);
  }
  if (score.measured == 0) return score;
  score.depth_rms_mm = std::sqrt(score.depth_rms_mm / score.measured);
  score.depth_bias_mm /= score.measured;
  return score;
}

Result<Score> decode_and_score(const Scene& scene, const DecodeOptions& options) {
  auto decoder = Decoder::create(scene.pattern, scene.calibration, 0, options);
  if (!decoder) return tl::unexpected(decoder.error());
  const auto decoding = decoder->decode(view(scene.frame));
  if (!decoding) return tl::unexpected(decoding.error());
  return score(scene, (*decoding)->points);
}

}  // namespace slsd
