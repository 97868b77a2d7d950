// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/observe/print_shift.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Geometry>

#include "core/calibrate/observe/board_region.hpp"
#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

constexpr int kReachPx = 24;
constexpr std::size_t kEdgesUsed = 6000, kEdgesMin = 200;
constexpr float kEdgeMin = 0.1F;   // of the light, natural logarithm per pixel
constexpr float kCapped = 0.3F;    // limit of an edge's weight
constexpr float kFaintLevels = 4;  // of 255: an offset, so that noise in the dark is no edge

/// The logarithm of a picture's light, smoothed over neighbouring pixels.
Image<float> log_light(const GreyView& picture) {
  return std::visit(
      [](const auto& view) {
        using Level = std::decay_t<decltype(*view.row(0))>;
        float brightest = 1;
        for (int y = 0; y < view.height; ++y) {
          brightest = std::max(brightest, static_cast<float>(*std::max_element(view.row(y), view.row(y) + view.width)));
        }
        const float scale = 255 / brightest;
        Image<float> light(view.width, view.height);
        for (int y = 0; y < view.height; ++y) {
          const Level* const rows[3] = {view.row(std::max(y - 1, 0)), view.row(y),
                                        view.row(std::min(y + 1, view.height - 1))};
          for (int x = 0; x < view.width; ++x) {
            const int left = std::max(x - 1, 0), right = std::min(x + 1, view.width - 1);
            float sum = 0;
            for (int i = 0; i < 3; ++i) {
              const float row = static_cast<float>(rows[i][left]) + 2 * static_cast<float>(rows[i][x]) +
                                static_cast<float>(rows[i][right]);
              sum += i == 1 ? 2 * row : row;
            }
            light.row(y)[x] = std::log(scale * sum / 16 + kFaintLevels);
          }
        }
        return light;
      },
      picture);
}

struct Gradient {
  float x, y;
};

Gradient gradient_at(const Image<float>& light, int x, int y) {
  const auto capped = [](float slope) { return std::clamp(slope / 2, -kCapped, kCapped); };
  return {capped(light.at(x + 1, y) - light.at(x - 1, y)), capped(light.at(x, y + 1) - light.at(x, y - 1))};
}

/// The gradients of a whole picture.
struct GradientField {
  Image<float> x, y;

  explicit GradientField(const Image<float>& light)
      : x(light.width(), light.height()), y(light.width(), light.height()) {
    for (int row = 1; row < light.height() - 1; ++row) {
      for (int column = 1; column < light.width() - 1; ++column) {
        const Gradient gradient = gradient_at(light, column, row);
        x.at(column, row) = gradient.x, y.at(column, row) = gradient.y;
      }
    }
  }
};

struct Edge {
  int x, y;
  Gradient gradient;
};

/// The edges of the print, evenly over the board. Edges beside the board may stand still while it moves.
std::vector<Edge> edges_of(const Image<float>& light, const Board& board, const BoardSighting& sighting) {
  const BoardRegion region(board, sighting);
  Eigen::AlignedBox2d box;
  for (const SeenPoint& point : sighting.points) box.extend(point.pixel);
  const double margin = 1.5 * sighting.pitch_px;
  const int inner = kReachPx + 2;
  const int left = std::max(inner, static_cast<int>(box.min().x() - margin)),
            top = std::max(inner, static_cast<int>(box.min().y() - margin)),
            right = std::min(light.width() - inner, static_cast<int>(box.max().x() + margin)),
            bottom = std::min(light.height() - inner, static_cast<int>(box.max().y() + margin));
  std::vector<Edge> edges;
  for (int y = top; y < bottom; ++y) {
    for (int x = left; x < right; ++x) {
      const Gradient gradient = gradient_at(light, x, y);
      if (std::hypot(gradient.x, gradient.y) < kEdgeMin) continue;
      if (region.contains({x, y})) edges.push_back({x, y, gradient});
    }
  }
  const std::size_t step = edges.size() / kEdgesUsed + 1;
  std::vector<Edge> some;
  for (std::size_t i = 0; i < edges.size(); i += step) some.push_back(edges[i]);
  return some;
}

}  // namespace

PrintShift find_print_shift(const GreyView& white, const GreyView& pattern, const Board& board,
                            const BoardSighting& sighting) {
  if (size_of(white) != size_of(pattern)) return {};
  const std::vector<Edge> edges = edges_of(log_light(white), board, sighting);
  if (edges.size() < kEdgesMin) return {};
  const GradientField lit(log_light(pattern));
  constexpr int kSide = 2 * kReachPx + 1;
  std::vector<float> sums(kSide * kSide);
  for (const Edge& edge : edges) {
    for (int row = 0; row < kSide; ++row) {
      const float* const x = lit.x.row(edge.y + row - kReachPx) + edge.x - kReachPx;
      const float* const y = lit.y.row(edge.y + row - kReachPx) + edge.x - kReachPx;
      float* const sum = sums.data() + static_cast<std::ptrdiff_t>(row) * kSide;
      for (int i = 0; i < kSide; ++i) sum[i] += edge.gradient.x * x[i] + edge.gradient.y * y[i];
    }
  }
  const std::vector<double> agreement(sums.begin(), sums.end());
  const auto best = std::ranges::max_element(agreement);
  const auto at = static_cast<int>(best - agreement.begin());
  const double usual = median_of(agreement);
  std::vector<double> off;
  for (const double one : agreement) off.push_back(std::abs(one - usual));
  const double deviation = kSigmaOfMedian * median_of(std::move(off));
  return {Eigen::Vector2d(at % kSide - kReachPx, at / kSide - kReachPx),
          deviation > 0 ? (*best - usual) / deviation : 0};
}

}  // namespace slsd
