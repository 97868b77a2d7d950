// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/pixel_judge.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace slsd {
namespace {

/// How far the planes of nodes beside each other may differ where they are blended, px, and in standard deviations.
constexpr float kAgreePx = 0.12F, kAgreeSigmas = 4;
/// The share of a node's window that agrees, from which on what does not is noise.
constexpr float kCleanSupport = 0.9F;
/// Logarithms: how much likelier the surface has to be than another, or none, by what is around a pixel. Blur makes
/// neighbours alike, some three pixels to one that is independent; so this is a chance of one in a thousand.
constexpr float kEvidenceMin = 20, kHalfMin = -3;
/// The same between nodes that are one surface: nothing may speak against it.
constexpr float kEnclosedMin = -2;
/// Of a pixel by itself: that it is lit, and as it should be.
constexpr float kFirmMin = 2;
/// One standard deviation that a plane adds where it is continued beyond its node to an edge, px.
constexpr float kEdgePx = 0.03F;
/// Planes that differ by less at a cell are one candidate, px.
constexpr float kSamePx = 0.08F;

// The axes of the table.
constexpr int kExpected = 17, kSeen = 48, kSlopes = 4, kNoises = 6;
constexpr float kSeenFirst = -0.5F, kSeenStep = 0.05F, kSlopeStep = 0.1F, kNoiseFirst = 0.01F;

// What is known of a pixel's level where a surface is, in units of its gain.
constexpr float kMisfit = 0.04F;                               // of the dark: light that the scene scatters
constexpr float kGainSpread = 0.12F;                           // of the light: print, relief
constexpr float kPlaceSpread = 0.2F;                           // camera px
constexpr float kOutliers = 0.05F;                             // of the pixels
constexpr float kLevels = 1.6F;                                // over which outliers are spread
constexpr float kDark = 0.4F, kLit = 0.35F, kBetween = 0.25F;  // of the pixels of another surface

float normal(float off, float sigma) {
  return std::exp(-0.5F * off * off / (sigma * sigma)) / (sigma * std::sqrt(2 * std::numbers::pi_v<float>));
}

}  // namespace

Evidence EvidenceTable::reckon(float expected, float seen, float slope, float noise) {
  const auto square = [](float x) { return x * x; };
  const auto sigma = [&](float light, float steep) {
    return std::sqrt(square(noise) + square(kMisfit) + square(kGainSpread * light) + square(kPlaceSpread * steep));
  };
  const float outlier = 1 / kLevels;
  const float here = (1 - kOutliers) * normal(seen - expected, sigma(expected, slope)) + kOutliers * outlier;
  const float dark = normal(seen, sigma(0, 0));
  const float another = kDark * dark + kLit * normal(seen - 1, sigma(1, 0)) + kBetween * outlier;
  const float unlit = (1 - kOutliers) * dark + kOutliers * outlier;
  return {std::log(here / another), std::log(here / unlit)};
}

EvidenceTable::EvidenceTable() {
  table_.reserve(static_cast<std::size_t>(kExpected) * kSeen * kSlopes * kNoises);
  for (int noise = 0; noise < kNoises; ++noise)
    for (int slope = 0; slope < kSlopes; ++slope)
      for (int expected = 0; expected < kExpected; ++expected)
        for (int seen = 0; seen < kSeen; ++seen)
          table_.push_back(
              reckon(static_cast<float>(expected) / (kExpected - 1), kSeenFirst + kSeenStep * static_cast<float>(seen),
                     kSlopeStep * static_cast<float>(slope), kNoiseFirst * static_cast<float>(1 << noise)));
}

Evidence EvidenceTable::at(float expected, float seen, float slope, float noise) const {
  const auto step = [](float value, int count) {
    return static_cast<int>(std::clamp(value + 0.5F, 0.F, static_cast<float>(count - 1)));
  };
  int loud = 0;
  for (float limit = 1.41F * kNoiseFirst; loud + 1 < kNoises && noise > limit; limit *= 2) ++loud;
  const int row =
      (loud * kSlopes + step(slope / kSlopeStep, kSlopes)) * kExpected + step(expected * (kExpected - 1), kExpected);
  return table_[static_cast<std::size_t>(row) * kSeen + step((seen - kSeenFirst) / kSeenStep, kSeen)];
}

/// What lies between four nodes that are one surface.
struct Blend {
  float inverse_depth, sigma_px, light;
};

/// The pixels between four nodes.
struct PixelJudge::Cell {
  const DenseFrame& frame;
  const PatternField& field;
  const PatchGeometry& geometry;
  const SurfaceGrid& grid;
  DenseMap& map;
  int column, row;               // of the node at its top left
  int left, top, right, bottom;  // its pixels, right and bottom beyond the last
  std::array<const SurfaceNode*, kCandidates> candidates{};
  std::array<Eigen::Vector2f, kCandidates> places{};
  int count = 0;

  [[nodiscard]] float value(int k, float x, float y) const {
    return candidates[k]->plane.at(x - places[k].x(), y - places[k].y());
  }
  void add(int at_column, int at_row) {
    const SurfaceNode* node = grid.good(at_column, at_row);
    if (node == nullptr || count == kCandidates) return;
    candidates[count] = node;
    places[count] = {static_cast<float>(grid.x_of(at_column)), static_cast<float>(grid.y_of(at_row))};
    ++count;
  }
  /// The same, where no candidate is like it, and it is not too far.
  void add_other(int at_column, int at_row, int window_px) {
    const int before = count;
    add(at_column, at_row);
    if (count == before) return;
    const float x = 0.5F * static_cast<float>(left + right - 1), y = 0.5F * static_cast<float>(top + bottom - 1);
    const Eigen::Vector2f away = (places[before] - Eigen::Vector2f(x, y)).cwiseAbs();
    if (away.maxCoeff() > static_cast<float>(window_px)) {
      count = before;
      return;
    }
    for (int k = 0; k < before; ++k) {
      const float off = (value(k, x, y) - value(before, x, y)) / candidates[k]->per_px;
      if (std::abs(off) < kSamePx) {
        count = before;
        return;
      }
    }
  }
  /// Whether the nodes at the corners are.
  [[nodiscard]] bool one_surface() const {
    if (count != 4) return false;
    const float x = 0.5F * static_cast<float>(left + right - 1), y = 0.5F * static_cast<float>(top + bottom - 1);
    float least = 1, most = 0, noise = 0;
    for (int k = 0; k < 4; ++k) {
      least = std::min(least, value(k, x, y)), most = std::max(most, value(k, x, y));
      noise = std::max(noise, candidates[k]->noise_px);
    }
    return (most - least) / candidates[0]->per_px < kAgreePx + kAgreeSigmas * noise;
  }
  [[nodiscard]] bool clean() const {
    return std::all_of(candidates.begin(), candidates.begin() + 4,
                       [](const SurfaceNode* node) { return node->support >= kCleanSupport; });
  }
  [[nodiscard]] Blend blended(int x, int y) const {
    const float per_stride = 1 / static_cast<float>(grid.stride_px());
    const float fx = static_cast<float>(x - left) * per_stride, fy = static_cast<float>(y - top) * per_stride;
    const float weights[4] = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
    Blend sum{0, 0, 0};
    for (int k = 0; k < 4; ++k) {
      const SurfaceNode& node = *candidates[k];
      sum.inverse_depth += weights[k] * value(k, static_cast<float>(x), static_cast<float>(y));
      sum.sigma_px += weights[k] * node.sigma_px;
      sum.light += weights[k] * (node.gain + node.offset);
    }
    return sum;
  }
};

void PixelJudge::write(const Cell& cell, int x, int y, float inverse_depth, float sigma_px, float per_px, float light,
                       bool firm) const {
  const std::size_t pixel = static_cast<std::size_t>(y) * cell.map.width + x;
  const float depth = 1 / inverse_depth;
  if (!(depth >= static_cast<float>(options_.depth_min_mm) && depth <= static_cast<float>(options_.depth_max_mm))) {
    cell.map.pixels[pixel] = DensePixel::kOutOfDepthRange;
    return;
  }
  cell.map.depth_mm[pixel] = depth;
  cell.map.sigma_mm[pixel] = per_px * depth * depth * sigma_px;
  const auto of_full = static_cast<float>(255 / cell.frame.full);
  cell.map.intensity[pixel] = static_cast<std::uint8_t>(std::clamp(light * of_full, 1.F, 255.F));
  cell.map.pixels[pixel] = DensePixel::kMeasured;
  cell.map.firm[pixel] = firm;
}

void PixelJudge::blend(const Cell& cell) const {
  for (int y = cell.top; y < cell.bottom; ++y) {
    for (int x = cell.left; x < cell.right; ++x) {
      const Blend here = cell.blended(x, y);
      write(cell, x, y, here.inverse_depth, here.sigma_px, cell.candidates[0]->per_px, here.light, true);
    }
  }
}

/// What each pixel of the cell and around it says for a candidate's plane.
template <class T>
void PixelJudge::weigh(const ImageView<T>& pixels, const Cell& cell, int candidate,
                       std::vector<Evidence>& evidence) const {
  const SurfaceNode& node = *cell.candidates[candidate];
  const PatchMap map = cell.geometry.map_at(cell.places[candidate], static_cast<double>(node.plane.inverse_depth));
  PatchState state;
  state.slope_x = node.plane.slope_x / node.per_px, state.slope_y = node.plane.slope_y / node.per_px;
  const Eigen::Matrix3f warp = map.base + map.shift * Eigen::RowVector3f(state.slope_x, state.slope_y, 0);
  const Eigen::Vector2f origin =
      map.origin_px.cast<float>() + node.across * Eigen::Vector2f(-map.along.y(), map.along.x());
  const float noise = cell.frame.noise.at(node.offset + 0.5F * node.gain) / node.gain;
  const float px_per_px = std::sqrt(std::abs(warp.topLeftCorner<2, 2>().determinant()));
  std::size_t at = 0;
  for (int y = cell.top - options_.reach_px; y < cell.bottom + options_.reach_px; ++y) {
    for (int x = cell.left - options_.reach_px; x < cell.right + options_.reach_px; ++x, ++at) {
      evidence[at] = {0, 0};
      if (!pixels.contains(x, y) || pixels.at(x, y) >= cell.frame.full) continue;
      const float dx = static_cast<float>(x) - map.middle_px.x(), dy = static_cast<float>(y) - map.middle_px.y();
      const Eigen::Vector3f q = warp * Eigen::Vector3f(dx, dy, 1);
      const Eigen::Vector2f p = q.head<2>() / q.z() + origin;
      const PatternField::Sample light = cell.field.at(p.x(), p.y());
      const float gain = std::max(0.3F * node.gain, node.gain + node.gain_x * dx + node.gain_y * dy);
      const float slope = px_per_px * std::max(std::abs(light.slope_u), std::abs(light.slope_v));
      evidence[at] = table_.at(light.value, (static_cast<float>(pixels.at(x, y)) - node.offset) / gain, slope, noise);
    }
  }
}

void PixelJudge::judge_pixels(const Cell& cell, bool one_surface, Scratch& scratch) const {
  const float least_evidence = one_surface ? kEnclosedMin : kEvidenceMin;
  const int reach = options_.reach_px, width = cell.right - cell.left + 2 * reach,
            height = cell.bottom - cell.top + 2 * reach;
  const std::size_t area = static_cast<std::size_t>(width) * height;
  for (int k = 0; k < cell.count; ++k) {
    scratch.evidence[k].resize(area);
    std::visit([&](const auto& pixels) { weigh(pixels, cell, k, scratch.evidence[k]); }, cell.frame.pixels);
  }
  for (int y = cell.top; y < cell.bottom; ++y) {
    for (int x = cell.left; x < cell.right; ++x) {
      int best = -1;
      float most = 0;
      for (int k = 0; k < cell.count; ++k) {
        // Of the whole, and of its halves to each side, the pixel's own line in both: what goes on on one side alone
        // ends here, or before.
        Evidence sum{0, 0}, halves[4] = {};
        for (int j = 0; j <= 2 * reach; ++j) {
          const Evidence* line =
              &scratch.evidence[k][static_cast<std::size_t>(y - cell.top + j) * width + x - cell.left];
          Evidence before{0, 0}, all{0, 0};
          for (int i = 0; i <= 2 * reach; ++i) {
            all += line[i];
            if (i <= reach) before += line[i];
            if (i == reach) halves[1] += line[i];
          }
          sum += all, halves[0] += before;
          halves[1] += all, halves[1] -= before;
          if (j <= reach) halves[2] += all;
          if (j >= reach) halves[3] += all;
        }
        float least = sum.least();
        for (const Evidence& half : halves) least = std::min(least, half.least() + least_evidence - kHalfMin);
        if (best < 0 || least > most) best = k, most = least;
      }
      const std::size_t pixel = static_cast<std::size_t>(y) * cell.map.width + x;
      if (best < 0 || most < least_evidence) {
        cell.map.pixels[pixel] = DensePixel::kNoSupport;
        continue;
      }
      const Evidence& own =
          scratch.evidence[best][static_cast<std::size_t>(y - cell.top + reach) * width + x - cell.left + reach];
      const bool firm = own.against_unlit > kFirmMin;
      const SurfaceNode& node = *cell.candidates[best];
      if (one_surface) {
        const Blend here = cell.blended(x, y);
        write(cell, x, y, here.inverse_depth, here.sigma_px, node.per_px, here.light, firm);
        continue;
      }
      const float dx = static_cast<float>(x) - cell.places[best].x(),
                  dy = static_cast<float>(y) - cell.places[best].y();
      const float sigma = std::sqrt(node.sigma_px * node.sigma_px + kEdgePx * kEdgePx +
                                    node.slope_noise * node.slope_noise * (dx * dx + dy * dy));
      write(cell, x, y, node.plane.at(dx, dy), sigma, node.per_px, node.gain + node.offset, firm);
    }
  }
}

void PixelJudge::judge_cell(const Cell& from, Scratch& scratch) const {
  Cell cell = from;
  const int c = cell.column, r = cell.row;
  cell.add(c, r), cell.add(c + 1, r), cell.add(c, r + 1), cell.add(c + 1, r + 1);
  if (cell.one_surface()) return cell.clean() ? blend(cell) : judge_pixels(cell, true, scratch);
  cell.count = 0;
  for (const auto& [dx, dy] :
       {std::pair(0, 0), {1, 0}, {0, 1}, {1, 1}, {-1, 0}, {2, 0}, {0, -1}, {0, 2}, {-1, 1}, {2, 1}, {1, -1}, {1, 2}}) {
    cell.add_other(c + dx, r + dy, options_.window_px);
  }
  if (cell.count > 0) judge_pixels(cell, false, scratch);
}

void PixelJudge::judge(const DenseFrame& frame, const PatternField& field, const PatchGeometry& geometry,
                       const SurfaceGrid& grid, DenseMap& map, Executor& executor) {
  if (scratch_.size() < static_cast<std::size_t>(executor.workers())) scratch_.resize(executor.workers());
  const int stride = grid.stride_px();
  executor.run(grid.rows() + 1, [&](int part, int worker) {
    const int row = part - 1;
    for (int column = -1; column < grid.columns(); ++column) {
      Cell cell{frame, field, geometry, grid, map, column, row, 0, 0, 0, 0};
      cell.left = std::max(0, grid.x_of(column)), cell.top = std::max(0, grid.y_of(row));
      cell.right = std::min(map.width, grid.x_of(column) + stride);
      cell.bottom = std::min(map.height, grid.y_of(row) + stride);
      if (cell.left < cell.right && cell.top < cell.bottom) judge_cell(cell, scratch_[worker]);
    }
  });
}

}  // namespace slsd
