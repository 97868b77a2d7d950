// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/adversary/scenes/scene_frames.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace slsd::adversary {
namespace {

constexpr std::uint32_t kSceneSeeds = 1000;  // other numbers than those of the frames on the grid
constexpr int kAroundPx = 2;                 // a symbol at an edge may belong to the surface beside it
constexpr double kCellReach = 0.75;          // of the pitch: from the cell's centre to the light that is there
constexpr double kWrongMm = 40, kAirMm = 5;

/// What the camera sees of a symbol.
struct Sighting {
  struct Corner {
    float off_px = 1;  // how far, in the projector, the nearest pixel is; farther ones show no corner
    int x = 0, y = 0;
    bool seen = false;
  };
  std::array<Corner, 4> corners;  // around the symbol
  int pixels = 0;
  std::uint16_t part = SceneTruth::kNothing;
  bool split = false;  // on two surfaces

  [[nodiscard]] double area_px() const {
    double twice = 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Corner &from = corners[i], &to = corners[(i + 1) % corners.size()];
      twice += static_cast<double>(from.x) * to.y - static_cast<double>(to.x) * from.y;
    }
    return std::abs(twice) / 2;
  }
  /// Whether nothing hides its middle, either.
  /// @param facing_px  area on a surface that faces both devices
  [[nodiscard]] bool is_whole(double facing_px) const {
    constexpr double kCovered = 0.7, kForeshortened = 0.25;
    const double area = area_px();
    return !split && std::ranges::all_of(corners, &Corner::seen) && pixels >= kCovered * area &&
           area >= kForeshortened * facing_px;
  }
};

}  // namespace

SceneFrameMaker::SceneFrameMaker(const Pattern& pattern, Calibration rig)
    : pattern_(pattern), rig_(std::move(rig)), shown_(draw_pattern(pattern)), noise_(noise_table()) {}

SceneFrame SceneFrameMaker::take(const DepthScene& scene, const SceneLight& light, Random& random) const {
  SceneFrame frame{{}, look_at(scene, rig_)};
  frame.image = expose(frame.truth, shown_, light, noise_, random);
  return frame;
}

SceneFrame SceneFrameMaker::make(int kind, std::uint32_t number, bool clean) const {
  constexpr double kReferenceMm = 2000;
  std::seed_seq seed{kSceneSeeds + static_cast<std::uint32_t>(kind), number,
                     static_cast<std::uint32_t>(pattern_.options.symbol_size_px)};
  Random random(seed);
  const DepthScene scene =
      scene_kinds()[static_cast<std::size_t>(kind)].lay(random, pattern_.pitch_px() / rig_.projector.fx * kReferenceMm);
  const SceneLight light = clean ? SceneLight::clean() : SceneLight::draw(random);
  return take(scene, light, random);
}

SceneVerdict SceneFrameMaker::judge(const SceneTruth& truth, const std::vector<CloudPoint>& points) const {
  const auto reach = static_cast<float>(kCellReach * pattern_.pitch_px());
  SceneVerdict verdict;
  const std::vector<bool> visible = visible_symbols(truth);
  verdict.visible = static_cast<int>(std::ranges::count(visible, true));
  for (const CloudPoint& point : points) {
    const int x = static_cast<int>(std::lround(point.camera_u)), y = static_cast<int>(std::lround(point.camera_v));
    const auto u = static_cast<float>(pattern_.symbol_centre_u_px(point.column)),
               v = static_cast<float>(pattern_.symbol_centre_v_px(point.row));
    bool shown = false;
    float off_mm = std::numeric_limits<float>::max();
    for (int at_y = y - kAroundPx; at_y <= y + kAroundPx; ++at_y) {
      for (int at_x = x - kAroundPx; at_x <= x + kAroundPx; ++at_x) {
        if (!truth.depth_mm.view().contains(at_x, at_y)) continue;
        const auto& [lit_u, lit_v] = truth.projector_px.at(at_x, at_y);
        shown = shown || (lit_u >= 0 && std::abs(lit_u - u) < reach && std::abs(lit_v - v) < reach);
        if (truth.part.at(at_x, at_y) != SceneTruth::kNothing)
          off_mm = std::min(off_mm, std::abs(truth.depth_mm.at(at_x, at_y) - point.z));
      }
    }
    if (!shown && off_mm > kWrongMm) {
      ++verdict.wrong, verdict.wrong_points.push_back(point);
    } else if (off_mm > kAirMm) {
      ++verdict.in_the_air;
    } else {
      ++verdict.right;
      verdict.decoded +=
          shown && visible[static_cast<std::size_t>(point.row) * pattern_.whole_columns() + point.column];
    }
  }
  return verdict;
}

std::vector<bool> SceneFrameMaker::visible_symbols(const SceneTruth& truth) const {
  const int columns = pattern_.whole_columns(), rows = pattern_.whole_rows(), pitch = pattern_.pitch_px();
  const auto side = static_cast<float>(pattern_.options.symbol_size_px - 1);
  const std::array<std::array<float, 2>, 4> corners{{{0, 0}, {side, 0}, {side, side}, {0, side}}};
  std::vector<Sighting> sightings(static_cast<std::size_t>(columns) * rows);
  for (int y = 0; y < truth.part.height(); ++y) {
    for (int x = 0; x < truth.part.width(); ++x) {
      const auto& [u, v] = truth.projector_px.at(x, y);
      const int column = static_cast<int>(u) / pitch, row = static_cast<int>(v) / pitch;
      if (u < 0 || column >= columns || row >= rows) continue;
      Sighting& sighting = sightings[static_cast<std::size_t>(row) * columns + column];
      const float right = u - static_cast<float>(pattern_.symbol_left_px(column)),
                  down = v - static_cast<float>(pattern_.symbol_top_px(row));
      for (std::size_t i = 0; i < corners.size(); ++i) {
        const float off = std::max(std::abs(right - corners[i][0]), std::abs(down - corners[i][1]));
        if (off < sighting.corners[i].off_px) sighting.corners[i] = {off, x, y, true};
      }
      if (right < 0 || down < 0 || right > side || down > side) continue;
      ++sighting.pixels;
      const std::uint16_t part = truth.part.at(x, y);
      sighting.split = sighting.split || (sighting.part != SceneTruth::kNothing && sighting.part != part);
      sighting.part = part;
    }
  }
  const double scale = rig_.cameras[0].lens.fx / rig_.projector.fx;
  const double facing_px = side * side * scale * scale;
  std::vector<bool> visible;
  for (const Sighting& sighting : sightings) visible.push_back(sighting.is_whole(facing_px));
  return visible;
}

}  // namespace slsd::adversary
