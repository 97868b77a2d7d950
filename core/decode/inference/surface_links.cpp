// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/inference/surface_links.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/LU>

#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
constexpr std::size_t kSamplesMin = 20;
/// Slips on one surface, cells: their usual width without a sample, and the limits of the width.
constexpr float kUsualSlip = 0.008F, kSlipMin = 0.002F, kSlipMax = 0.02F, kSlipWidthMax = 0.1F;
constexpr float kSlipRange = 0.6F;   // largest slip across an edge, cells
constexpr float kNatsMin = -4;       // strongest evidence of a slip against a link
constexpr float kLightNatsMin = -8;  // strongest evidence of light against a link
/// Ratio of light across an edge, standard deviation of its logarithm; and the limits of its width on one surface.
constexpr float kLightAcross = 0.7F, kLightMin = 0.03F, kLightMax = 0.3F, kLightWidthMax = 0.5F;

/// Density of Student's t with four degrees of freedom.
float student(float x, float width) {
  const float t = x / width, tail = 1 + t * t / 4;
  return 0.375F / (width * tail * tail * std::sqrt(tail));
}

float normal(float x, float sigma) {
  const float t = x / sigma;
  return std::exp(-0.5F * t * t) / sigma / std::sqrt(2 * std::numbers::pi_v<float>);
}

}  // namespace

void SurfaceLinks::measure_bends(const NodesSeen& seen, const CellGate& gate, const CellGrid& grid,
                                 Executor& executor) {
  bends_.assign(seen.nodes.size(), {Eigen::Vector2f(kUnknown, kUnknown), Eigen::Vector2f(kUnknown, kUnknown)});
  executor.run_ranges(seen.nodes.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) {
      const GridNode& node = seen.nodes[i];
      const std::int32_t cell = seen.labels[i];
      if (cell < 0) continue;
      const Eigen::Vector2f along =
          gate.way_of_line(static_cast<std::int32_t>(i), grid.row_of(cell), grid.column_of(cell));
      const Eigen::Matrix2f cells_from_camera = node.frame.inverse() / pitch_px_;
      for (const Direction d : {kRight, kDown}) {
        const std::int32_t on = seen.beside[i][d], behind = seen.beside[i][opposite(d)];
        if (on < 0 || behind < 0) continue;
        const Eigen::Vector2f bend =
            cells_from_camera * (seen.nodes[on].centre_px + seen.nodes[behind].centre_px - 2 * node.centre_px);
        bends_[i][d] = {along.dot(bend), along.x() * bend.y() - along.y() * bend.x()};
      }
    }
  });
}

float SurfaceLinks::usual_slip(const NodesSeen& seen, const LetterEvidence& letters) {
  sample_.clear();
  const auto whole = [&](std::int32_t node) { return letters.shapes()[static_cast<std::size_t>(node)].is_well_seen(); };
  for (std::size_t i = 0; i < seen.nodes.size(); ++i) {
    for (const Direction d : {kRight, kDown}) {
      if (std::isnan(bends_[i][d].x()) || !whole(static_cast<std::int32_t>(i))) continue;
      if (whole(seen.beside[i][d]) && whole(seen.beside[i][opposite(d)])) sample_.push_back(std::abs(bends_[i][d].x()));
    }
  }
  return sample_.size() < kSamplesMin ? kUsualSlip : median_in_place(sample_);
}

void SurfaceLinks::measure_slips(const NodesSeen& seen, float least, Executor& executor) {
  nats_.assign(seen.nodes.size(), {});
  executor.run_ranges(seen.nodes.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) {
      for (const Direction d : {kRight, kDown}) {
        const std::int32_t other = seen.beside[i][d];
        if (other < 0 || seen.nodes[i].split || seen.nodes[other].split) continue;
        float most = 0;  // density
        const auto compare = [&](std::int32_t from, Direction way) {
          const Eigen::Vector2f bend = bends_[from][way % 2];
          if (std::isnan(bend.x())) return;
          const std::int32_t behind = seen.beside[from][opposite(way)];
          if (seen.nodes[behind].split) return;
          float before = bends_[behind][way % 2].x();
          if (before * bend.x() < 0) before = 0;  // one displaced symbol bends its neighbours the other way
          const float variance =
              least * least + 0.5F * bend.y() * bend.y() + (std::isnan(before) ? 0.F : 0.25F * before * before);
          const float width = std::min(std::sqrt(variance), kSlipWidthMax);
          most = std::max(most, student(bend.x(), width));
        };
        compare(static_cast<std::int32_t>(i), d);
        compare(other, opposite(d));
        if (most == 0) continue;
        nats_[i][d] = nats_[other][opposite(d)] = std::max(std::log(most * kSlipRange), kNatsMin);
      }
    }
  });
}

void SurfaceLinks::measure_light(const NodesSeen& seen, const LetterEvidence& letters) {
  light_.assign(seen.nodes.size(), kUnknown);
  std::array<float, kMaxLetters> sum{}, count{};
  for (std::size_t i = 0; i < seen.nodes.size(); ++i) {
    const float contrast = seen.moments[i].peak - seen.moments[i].background;
    if (seen.labels[i] < 0 || contrast <= 0) continue;
    light_[i] = std::log(contrast);
    if (!letters.shapes()[i].is_well_seen()) continue;
    const int letter = letters.letter_of(seen.labels[i]);
    sum[letter] += light_[i], count[letter] += 1;
  }
  for (std::size_t i = 0; i < seen.nodes.size(); ++i) {
    if (std::isnan(light_[i])) continue;
    const int letter = letters.letter_of(seen.labels[i]);
    light_[i] = count[letter] > 0 ? light_[i] - sum[letter] / count[letter] : kUnknown;
  }
}

void SurfaceLinks::add_light(const NodesSeen& seen, const CellGrid& grid, Executor& executor) {
  const auto difference = [&](std::size_t i, Direction d) {
    const std::int32_t other = seen.beside[i][d];
    if (other < 0 || seen.labels[i] < 0 || seen.labels[other] != grid.beyond(seen.labels[i], d)) return kUnknown;
    return light_[other] - light_[i];
  };
  sample_.clear();
  for (std::size_t i = 0; i < seen.nodes.size(); ++i)
    for (const Direction d : {kRight, kDown})
      if (const float by = difference(i, d); !std::isnan(by)) sample_.push_back(std::abs(by));
  if (sample_.size() < kSamplesMin) return;
  constexpr float kWidthOfMedian = 1.35F;  // for Student's t with four degrees of freedom: 1 / its quartile
  const float width = std::clamp(kWidthOfMedian * median_in_place(sample_), kLightMin, kLightMax);
  constexpr float kOfBefore = 0.5F;  // towards a limb, light falls faster from link to link
  executor.run_ranges(seen.nodes.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) {
      for (const Direction d : {kRight, kDown}) {
        const float by = difference(i, d);
        if (std::isnan(by)) continue;
        const float across = normal(by, kLightAcross);
        float most = student(by, width);  // density
        if (most >= across) continue;
        const auto compare = [&](float before) {
          if (!(before * by >= 0)) return;
          most = std::max(most, student(by, std::min(std::hypot(width, kOfBefore * before), kLightWidthMax)));
        };
        const std::int32_t on = seen.beside[i][d], behind = seen.beside[i][opposite(d)];
        if (behind >= 0) compare(difference(behind, d));
        compare(difference(on, d));
        const float nats = std::clamp(std::log(most / across), kLightNatsMin, 0.F);
        nats_[i][d] += nats;
        nats_[seen.beside[i][d]][opposite(d)] += nats;
      }
    }
  });
}

void SurfaceLinks::measure(const NodesSeen& seen, const LetterEvidence& letters, const CellGate& gate,
                           Executor& executor) {
  measure_bends(seen, gate, letters.grid(), executor);
  constexpr float kWidthOfUsual = 1.5F;
  measure_slips(seen, std::clamp(kWidthOfUsual * usual_slip(seen, letters), kSlipMin, kSlipMax), executor);
  measure_light(seen, letters);
  add_light(seen, letters.grid(), executor);
}

}  // namespace slsd
