// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/corpus/score.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
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

/// A right point on a smooth surface.
struct Measurement {
  double depth_mm, error_mm;
  bool resolvable;
};

/// The error at the pixel where the camera sees the point.
Measurement measure(const CloudPoint& point, const Lens& camera, const SurfaceTruth& surface, bool resolvable) {
  const Eigen::Vector3d position(point.x, point.y, point.z);
  return {point.z, point.z - surface.depth_mm(camera.project(position)), resolvable};
}

template <class Part>
double median(const std::vector<Measurement>& measurements, Part part) {
  std::vector<double> values;
  for (const Measurement& measurement : measurements) values.push_back(part(measurement));
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

void add_depth(const std::vector<Measurement>& measurements, Score& score) {
  score.measured = static_cast<int>(measurements.size());
  if (measurements.empty()) return;
  const double middle = median(measurements, [](const Measurement& m) { return m.error_mm; });
  const double deviation = median(measurements, [&](const Measurement& m) { return std::abs(m.error_mm - middle); });
  const double limit =
      inlier_limit_mm(deviation, median(measurements, [](const Measurement& m) { return m.depth_mm; }));
  for (const Measurement& m : measurements) {
    score.depth_rms_mm += m.error_mm * m.error_mm;
    score.depth_bias_mm += m.error_mm;
    score.depth_worst_mm = std::max(score.depth_worst_mm, std::abs(m.error_mm));
    score.inliers -= m.resolvable && std::abs(m.error_mm - middle) > limit ? 1 : 0;
  }
  score.depth_rms_mm = std::sqrt(score.depth_rms_mm / score.measured);
  score.depth_bias_mm /= score.measured;
}

}  // namespace

double inlier_limit_mm(double deviation_median_mm, double depth_median_mm) {
  constexpr double kSigmaOfMedian = 1.4826;  // of a normal distribution
  return std::max(5 * kSigmaOfMedian * deviation_median_mm, 0.5 * std::pow(depth_median_mm / 2000, 2));
}

Score score(const Scene& scene, const std::vector<CloudPoint>& points) {
  Score score;
  for (const CellTruth& cell : scene.truth) score.resolvable += cell.resolvable ? 1 : 0;
  std::set<Cell> taken;
  std::vector<Measurement> measurements;
  for (const CloudPoint& point : points) {
    const CellTruth* cell = find(scene.truth, point);
    const bool first = taken.emplace(point.column, point.row).second;
    if (cell == nullptr || !first || !cell->covers({point.camera_u, point.camera_v})) {
      score.wrong.push_back(point);
      continue;
    }
    score.decoded += cell->resolvable ? 1 : 0;
    if (cell->surface)
      measurements.push_back(measure(point, scene.calibration.cameras.front().lens, *cell->surface, cell->resolvable));
  }
  score.inliers = score.decoded;
  add_depth(measurements, score);
  return score;
}

DecodeOptions papers_way() {
  DecodeOptions options;
  options.binarize = options.find_regions = options.classify = options.centre = Method::kPaper;
  options.link_grid = options.decode_windows = options.correspond = Method::kPaper;
  return options;
}

Result<Score> decode_and_score(const Scene& scene, const DecodeOptions& options) {
  auto decoder = Decoder::create(scene.pattern, scene.calibration, 0, options);
  if (!decoder) return tl::unexpected(decoder.error());
  const auto decoding = decoder->decode(view(scene.frame));
  if (!decoding) return tl::unexpected(decoding.error());
  return score(scene, (*decoding)->points);
}

}  // namespace slsd
