// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/adversary/frames.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <opencv2/imgproc.hpp>

#include "core/geometry/epipolar/epipolar_gate.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd::adversary {
namespace {

constexpr int kWidth = 800, kHeight = 600;
constexpr double kNearestMm = 1300, kFarthestMm = 2450;
constexpr int kReach = 2;  // of the neighbourhood that has to be the pattern's for a light to be undecidable

Calibration cropped_rig() {
  Calibration rig = paper_rig();
  Lens& lens = rig.cameras[0].lens;
  lens.cx -= 0.5 * (lens.width_px - kWidth), lens.cy -= 0.5 * (lens.height_px - kHeight);
  lens.width_px = kWidth, lens.height_px = kHeight;
  return rig;
}

Eigen::Matrix3d matrix_of(const Lens& lens) {
  Eigen::Matrix3d matrix;
  matrix << lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1;
  return matrix;
}

Eigen::Vector2f through(const Eigen::Matrix3f& homography, float x, float y) {
  return (homography * Eigen::Vector3f(x, y, 1)).hnormalized();
}

bool is_slats(Kind kind) {
  return kind <= Kind::kSlats3to6;
}

}  // namespace

std::string_view to_string(Kind kind) {
  constexpr std::string_view kNames[kKinds] = {
      "slats, 1 symbol", "slats, 1 to 2",  "slats, 2",        "slats, 3 to 6",  "shelves, 1 to 2", "pickets, 1 to 6",
      "foreign",         "foreign beside", "random",          "random beside",  "mirrored",        "mutated, 5 to 40 %",
      "tiled",           "shifted rows",   "swapped patches", "two projectors", "two alike"};
  return kNames[static_cast<std::size_t>(kind)];
}

FrameMaker::FrameMaker(const Pattern& pattern, CodeArray foreign)
    : pattern_(pattern), foreign_(std::move(foreign)), rig_(cropped_rig()), noise_(noise_table()) {
  for (const int number : pattern.options.symbols)
    glyphs_.push_back(draw_symbol(number, pattern.options.symbol_size_px));
}

Shown FrameMaker::true_letters() const {
  Shown shown{pattern_.whole_rows(), pattern_.whole_columns(), {}, {}};
  for (int row = 0; row < shown.rows; ++row) {
    for (int column = 0; column < shown.columns; ++column) {
      shown.letters.push_back(static_cast<std::int8_t>(pattern_.array.at(row, column)));
      shown.source.push_back({static_cast<std::int16_t>(row), static_cast<std::int16_t>(column)});
    }
  }
  return shown;
}

Shown FrameMaker::letters_of(Kind kind, Random& random) const {
  const Shown truth = true_letters();
  Shown shown = truth;
  const int letters = pattern_.letters();
  const auto put = [&](int at, int letter) {
    shown.letters[at] = static_cast<std::int8_t>(letter), shown.source[at] = {-1, -1};
  };
  const auto copy = [&](int to_row, int to_column, int row, int column) {
    const int to = shown.index(to_row, to_column);
    if (!truth.contains(row, column)) return put(to, whole(random, 0, letters - 1));
    shown.letters[to] = truth.letters[truth.index(row, column)];
    shown.source[to] = truth.source[truth.index(row, column)];
  };
  const auto each = [&](auto&& act) {
    for (int row = 0; row < shown.rows; ++row)
      for (int column = 0; column < shown.columns; ++column) act(row, column);
  };
  // Beside the true pattern: beyond a line, inside a window, or in bands.
  const int form = whole(random, 0, 3), at_row = whole(random, shown.rows / 4, 3 * shown.rows / 4),
            at_column = whole(random, shown.columns / 3, 2 * shown.columns / 3), extent = whole(random, 2, 12);
  const auto beside = [&](int row, int column) {
    switch (form) {
      case 0:
        return row >= at_row;
      case 1:
        return column >= at_column;
      case 2:
        return std::abs(row - at_row) <= extent && std::abs(column - at_column) <= extent;
      default:
        return (row / extent + column / extent) % 2 == 0;
    }
  };
  switch (kind) {
    case Kind::kForeign:
    case Kind::kForeignBeside:
      each([&](int row, int column) {
        if (kind == Kind::kForeign || beside(row, column)) put(shown.index(row, column), foreign_.at(row, column));
      });
      break;
    case Kind::kRandom:
    case Kind::kRandomBeside:
      each([&](int row, int column) {
        if (kind == Kind::kRandom || beside(row, column)) put(shown.index(row, column), whole(random, 0, letters - 1));
      });
      break;
    case Kind::kMirrored:
      each([&](int row, int column) {
        put(shown.index(row, column), truth.letters[truth.index(row, shown.columns - 1 - column)]);
      });
      break;
    case Kind::kMutated: {
      const double share = uniform(random, 0.05, 0.4);
      each([&](int row, int column) {
        const int at = shown.index(row, column);
        if (uniform(random, 0, 1) < share) put(at, (truth.letters[at] + whole(random, 1, letters - 1)) % letters);
      });
      break;
    }
    case Kind::kTiled: {
      const int high = whole(random, 2, 14), wide = whole(random, 2, 14);
      const int top = whole(random, 0, shown.rows - high), left = whole(random, 0, shown.columns - wide);
      // Those of the same row are on their epipolar lines.
      const bool in_place = whole(random, 0, 1) == 1;
      const int phase_row = in_place ? ((-top % high) + high) % high : whole(random, 0, high - 1),
                phase_column = in_place ? ((-left % wide) + wide) % wide : whole(random, 0, wide - 1);
      each([&](int row, int column) {
        copy(row, column, top + (row + phase_row) % high, left + (column + phase_column) % wide);
      });
      break;
    }
    case Kind::kShiftedRows: {
      const int high = whole(random, 1, 3), reach = whole(random, 1, 3);
      const bool every_other = whole(random, 0, 1) == 1;
      int by = 0;
      for (int row = 0; row < shown.rows; ++row) {
        if (row % high == 0) by = every_other ? (by == 0 ? reach : 0) : whole(random, -reach, reach);
        for (int column = 0; column < shown.columns; ++column) copy(row, column, row, column - by);
      }
      break;
    }
    case Kind::kSwappedPatch:
      for (int patches = whole(random, 1, 8); patches > 0; --patches) {
        const int high = whole(random, 1, 10), wide = whole(random, 1, 10);
        const int top = whole(random, 8, shown.rows - high - 8), left = whole(random, 10, shown.columns - wide - 10);
        const bool same_rows = whole(random, 0, 1) == 1;
        const int other_top = same_rows ? top : whole(random, 0, shown.rows - high),
                  other_left = whole(random, 0, shown.columns - wide);
        for (int row = 0; row < high; ++row) {
          for (int column = 0; column < wide; ++column) {
            copy(top + row, left + column, other_top + row, other_left + column);
            copy(other_top + row, other_left + column, top + row, left + column);
          }
        }
      }
      break;
    default:
      break;
  }
  return shown;
}

Grey8 FrameMaker::draw(const Shown& shown, bool mirrored) const {
  const PatternOptions& options = pattern_.options;
  Grey8 image(options.projector_width_px, options.projector_height_px);
  for (int row = 0; row < shown.rows; ++row) {
    for (int column = 0; column < shown.columns; ++column) {
      const int letter = shown.letters[shown.index(row, column)];
      if (letter < 0) continue;
      const Grey8& glyph = glyphs_[letter];
      for (int y = 0; y < glyph.height(); ++y) {
        std::uint8_t* const to = image.row(pattern_.symbol_top_px(row) + y) + pattern_.symbol_left_px(column);
        for (int x = 0; x < glyph.width(); ++x)
          to[x] = glyph.at(mirrored ? glyph.width() - 1 - x : x, y) != 0 ? 255 : 0;
      }
    }
  }
  return image;
}

Eigen::Matrix3f FrameMaker::seen_on_plane(const Eigen::Vector3d& normal, double distance_mm) const {
  const RigidTransform& motion = rig_.cameras[0].projector_from_camera;
  const Eigen::Matrix3d homography = matrix_of(rig_.projector) *
                                     (motion.rotation + motion.translation * normal.transpose() / distance_mm) *
                                     matrix_of(rig_.cameras[0].lens).inverse();
  return homography.cast<float>();
}

void FrameMaker::lay_surfaces(Kind kind, Random& random, Frame& frame) const {
  const Lens& lens = rig_.cameras[0].lens;
  std::vector<Eigen::Matrix3f>& seen = frame.lights[0].projector_from_camera;
  frame.surface = Image<std::uint8_t>(kWidth, kHeight, 0);
  const auto facing = [&](double depth_mm) { return seen_on_plane(Eigen::Vector3d::UnitZ(), depth_mm); };
  // A symbol's pitch at 2 m, 14 mm for 18 px, is as wide in the camera at any depth.
  const double pitch_px = pattern_.pitch_px() * lens.fx / rig_.projector.fx * 1.0;
  if (is_slats(kind) || kind == Kind::kShelves) {
    const double low = kind == Kind::kSlats2 ? 2 : kind == Kind::kSlats3to6 ? 3 : 1;
    const double high = kind == Kind::kSlats1 ? 1.15 : kind == Kind::kSlats2 ? 2.15 : kind == Kind::kSlats3to6 ? 6 : 2;
    const bool gaps = kind != Kind::kShelves && whole(random, 0, 2) == 0;  // dark between the slats
    const double wall_mm = uniform(random, 2000, kFarthestMm);
    double top = uniform(random, -20, 0);
    for (bool board = true; top < kHeight; board = !board) {
      const bool wall = kind == Kind::kShelves && !board;
      const double height_px = pitch_px * (wall ? uniform(random, 2, 8) : uniform(random, low, high));
      const auto id = static_cast<std::uint8_t>(seen.size());
      seen.push_back(facing(wall ? wall_mm : uniform(random, kNearestMm, kFarthestMm)));
      const double gap_px = gaps ? uniform(random, 1, 8) : 0;
      for (int y = std::max(0, static_cast<int>(top)); y < std::min<double>(kHeight, top + height_px); ++y) {
        const bool dark = y >= top + height_px - gap_px;
        std::fill_n(frame.surface.row(y), kWidth, dark ? Frame::kNoSurface : id);
      }
      top += height_px;
    }
  } else if (kind == Kind::kPickets) {
    struct Picket {
      double left_mm, right_mm, depth_mm;
    };
    std::vector<Picket> pickets;
    const Eigen::Vector3d projector = rig_.cameras[0].projector_from_camera.inverse().translation;
    const double widest = whole(random, 0, 1) == 0 ? 2 : 6;
    for (double left = uniform(random, -20, 0); left < kWidth;) {
      const double width_px = pitch_px * uniform(random, 1, widest), depth = uniform(random, kNearestMm, kFarthestMm);
      pickets.push_back({(left - lens.cx) / lens.fx * depth, (left + width_px - lens.cx) / lens.fx * depth, depth});
      left += width_px;
      seen.push_back(facing(depth));
    }
    for (int x = 0; x < kWidth; ++x) {
      std::uint8_t id = Frame::kNoSurface;
      const double slope = (x - lens.cx) / lens.fx;
      for (std::size_t i = 0; i < pickets.size(); ++i) {
        const Picket& own = pickets[i];
        const double at = slope * own.depth_mm;
        if (at < own.left_mm || at >= own.right_mm) continue;
        id = static_cast<std::uint8_t>(i);
        for (const Picket& other : pickets) {  // which may stand in the projector's light
          if (other.depth_mm >= own.depth_mm) continue;
          const double share = (own.depth_mm - other.depth_mm) / (own.depth_mm - projector.z());
          const double crossing = at + (projector.x() - at) * share;
          if (crossing >= other.left_mm && crossing < other.right_mm) id = Frame::kNoSurface;
        }
      }
      for (int y = 0; y < kHeight; ++y) frame.surface.at(x, y) = id;
    }
  } else {
    const double down = uniform(random, -0.25, 0.25), right = uniform(random, -0.35, 0.35);  // drawn in this order
    const Eigen::Vector3d normal = Eigen::Vector3d(right, down, 1).normalized();
    seen.push_back(seen_on_plane(normal, uniform(random, 1650, 2250) * normal.z()));
  }
}

/// Beside, above or below the first; where it shines it is as bright, or brighter.
void FrameMaker::add_second_projector(Kind kind, Random& random, Frame& frame) const {
  Light& second = frame.lights.emplace_back();
  second.shown = true_letters();
  if (kind == Kind::kTwoProjectors) {
    for (std::size_t i = 0; i < second.shown.letters.size(); ++i) {
      const int row = static_cast<int>(i) / second.shown.columns, column = static_cast<int>(i) % second.shown.columns;
      second.shown.letters[i] = static_cast<std::int8_t>(foreign_.at(row, column));
      second.shown.source[i] = {-1, -1};
    }
  }
  second.image = draw(second.shown, false);
  // A part of its image is all that shines: else nothing were to be read of either.
  const PatternOptions& options = pattern_.options;
  const int left = whole(random, 0, options.projector_width_px * 2 / 3),
            top = whole(random, 0, options.projector_height_px / 2);
  for (int y = 0; y < options.projector_height_px; ++y) {
    for (int x = 0; x < options.projector_width_px; ++x)
      if (x < left || y < top) second.image.at(x, y) = 0;
  }
  const auto angle = static_cast<float>(whole(random, 0, 1) == 0 ? 0 : uniform(random, -0.15, 0.15)),
             scale = static_cast<float>(uniform(random, 0.85, 1.15));
  Eigen::Matrix3f pose = Eigen::Matrix3f::Identity();
  pose.topLeftCorner<2, 2>() << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  pose.topLeftCorner<2, 2>() *= scale;
  pose(0, 2) = static_cast<float>(uniform(random, -300, 300));
  pose(1, 2) = static_cast<float>(uniform(random, -200, 200));
  for (const Eigen::Matrix3f& seen : frame.lights[0].projector_from_camera)
    second.projector_from_camera.push_back(pose * seen);
  // Where the second one shines the first does not in half of the frames: side by side, not over each other.
  if (whole(random, 0, 1) == 0) return;
  Grey8& first = frame.lights[0].image;
  const Eigen::Matrix3f to_second = pose;
  for (int y = 0; y < first.height(); ++y) {
    for (int x = 0; x < first.width(); ++x) {
      const Eigen::Vector2f at = through(to_second, static_cast<float>(x), static_cast<float>(y));
      const bool beyond = at.x() >= static_cast<float>(left) && at.y() >= static_cast<float>(top) &&
                          at.x() < static_cast<float>(first.width()) && at.y() < static_cast<float>(first.height());
      if (beyond) first.at(x, y) = 0;
    }
  }
}

void FrameMaker::expose(Random& random, Frame& frame) {
  const float contrast = static_cast<float>(uniform(random, 60, 180)),
              dark = static_cast<float>(uniform(random, 5, 40));
  cv::Mat1f light(kHeight, kWidth, 0.F);
  for (const Light& from : frame.lights) {
    const Grey8& image = from.image;
    const int last_x = image.width() - 2, last_y = image.height() - 2;
    for (int y = 0; y < kHeight; ++y) {
      float* const to = light[y];
      const std::uint8_t* const surface = frame.surface.row(y);
      for (int x = 0; x < kWidth;) {
        const std::uint8_t id = surface[x];
        int end = x + 1;
        while (end < kWidth && surface[end] == id) ++end;
        if (id == Frame::kNoSurface) {
          x = end;
          continue;
        }
        const Eigen::Matrix3f& h = from.projector_from_camera[id];
        for (; x < end; ++x) {
          const auto px = static_cast<float>(x), py = static_cast<float>(y);
          const float per_w = 1 / (h(2, 0) * px + h(2, 1) * py + h(2, 2));
          const float u = (h(0, 0) * px + h(0, 1) * py + h(0, 2)) * per_w,
                      v = (h(1, 0) * px + h(1, 1) * py + h(1, 2)) * per_w;
          if (!(u >= 0 && v >= 0)) continue;
          const int left = static_cast<int>(u), top = static_cast<int>(v);
          if (left > last_x || top > last_y) continue;
          const float share_x = u - static_cast<float>(left), share_y = v - static_cast<float>(top);
          const std::uint8_t* const upper = image.row(top) + left;
          const std::uint8_t* const lower = image.row(top + 1) + left;
          const float above = static_cast<float>(upper[0]) + share_x * static_cast<float>(upper[1] - upper[0]);
          const float below = static_cast<float>(lower[0]) + share_x * static_cast<float>(lower[1] - lower[0]);
          to[x] += (above + share_y * (below - above)) / 255;
        }
      }
    }
  }
  // The bilinear mean of projector pixels blurs by about half a pixel already.
  cv::GaussianBlur(light, light, {}, uniform(random, 0.5, pattern_.options.symbol_size_px >= 12 ? 1.8 : 1.2));
  const float sigma = static_cast<float>(uniform(random, 0.5, 6));
  frame.image = Grey8(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    constexpr std::uint32_t kMask = kNoiseTable - 1;
    auto at = static_cast<std::uint32_t>(random());
    for (int x = 0; x < kWidth; ++x, ++at) {
      const float grey = dark + contrast * light(y, x) + sigma * noise_[at & kMask];
      frame.image.at(x, y) = static_cast<std::uint8_t>(std::clamp(grey + 0.5F, 0.F, 255.F));
    }
  }
}

Frame FrameMaker::make(Kind kind, std::uint32_t number) {
  std::seed_seq seed{static_cast<std::uint32_t>(kind), number,
                     static_cast<std::uint32_t>(pattern_.options.symbol_size_px)};
  Random random(seed);
  Frame frame;
  Light& light = frame.lights.emplace_back();
  light.shown = letters_of(kind, random);
  const bool mirrored = kind == Kind::kMirrored && whole(random, 0, 1) == 1;
  light.image = draw(light.shown, mirrored);
  if (mirrored) std::ranges::fill(light.shown.letters, std::int8_t{-1});
  lay_surfaces(kind, random, frame);
  if (kind == Kind::kTwoProjectors || kind == Kind::kTwoAlike) add_second_projector(kind, random, frame);
  expose(random, frame);
  return frame;
}

bool FrameMaker::undecidable(const Frame&, const Light& light, int surface, int row, int column,
                             const CloudPoint& point, double tolerance_px) const {
  const Eigen::Matrix3f camera_from_projector = light.projector_from_camera[surface].inverse();
  const EpipolarGate gate(rig_.cameras[0], rig_.projector, 100, 1e5);
  for (int y = -kReach; y <= kReach; ++y) {
    for (int x = -kReach; x <= kReach; ++x) {
      const int cell_row = point.row + y, cell_column = point.column + x;
      if (!light.shown.contains(row + y, column + x) || !light.shown.contains(cell_row, cell_column)) continue;
      if (light.shown.letters[light.shown.index(row + y, column + x)] != pattern_.array.at(cell_row, cell_column))
        return false;
      const Eigen::Vector2f seen =
          through(camera_from_projector, static_cast<float>(pattern_.symbol_centre_u_px(column + x)),
                  static_cast<float>(pattern_.symbol_centre_v_px(row + y)));
      const EpipolarSegment segment = gate.prepare(rig_.cameras[0].lens.undistort(seen.cast<double>()));
      const Eigen::Vector2d cell(pattern_.symbol_centre_u_px(cell_column), pattern_.symbol_centre_v_px(cell_row));
      if (std::abs(segment.residual_px(rig_.projector.undistort(cell))) > tolerance_px) return false;
    }
  }
  return true;
}

/// Whether a whole side of what was put in the pattern's place, from edge to edge along its row or its column, happens
/// to show the letters that the pattern has there: as if it had been put in with a row or a column less. Edges beyond
/// the camera's image count for nothing.
bool FrameMaker::is_side_alike(const Light& light, int surface, int row, int column, const CloudPoint& point) const {
  if (point.row != row || point.column != column) return false;
  const Shown& shown = light.shown;
  const Eigen::Matrix3f camera_from_projector = light.projector_from_camera[surface].inverse();
  const auto seen = [&](int at_row, int at_column) {
    const Eigen::Vector2f at =
        through(camera_from_projector, static_cast<float>(pattern_.symbol_centre_u_px(at_column)),
                static_cast<float>(pattern_.symbol_centre_v_px(at_row)));
    return at.x() >= 0 && at.y() >= 0 && at.x() < kWidth && at.y() < kHeight;
  };
  const auto moved_as = [&](int other_row, int other_column) {
    const auto& own = shown.source[shown.index(row, column)];
    const auto& other = shown.source[shown.index(other_row, other_column)];
    return own[0] >= 0 && other[0] - other_row == own[0] - row && other[1] - other_column == own[1] - column;
  };
  const auto alike_along = [&](int down, int right) {
    for (const int sign : {1, -1}) {
      for (int i = 0;; i += sign) {
        const int at_row = row + i * down, at_column = column + i * right;
        if (!shown.contains(at_row, at_column) || !moved_as(at_row, at_column) || !seen(at_row, at_column)) break;
        if (shown.letters[shown.index(at_row, at_column)] != pattern_.array.at(at_row, at_column)) return false;
      }
    }
    return true;
  };
  return alike_along(0, 1) || alike_along(1, 0);
}

Verdict FrameMaker::judge(const Frame& frame, const std::vector<CloudPoint>& points, double tolerance_px) const {
  constexpr int kAround = 3;  // px: a symbol at an edge belongs to the surface beside
  const auto pitch = static_cast<float>(pattern_.pitch_px());
  Verdict verdict;
  for (const CloudPoint& point : points) {
    const int x = static_cast<int>(std::lround(point.camera_u)), y = static_cast<int>(std::lround(point.camera_v));
    bool right = false, undecidable_here = false;
    std::array<bool, 256> asked{};
    for (int dy = -kAround; dy <= kAround && !right; ++dy) {
      for (int dx = -kAround; dx <= kAround && !right; ++dx) {
        if (!frame.surface.view().contains(x + dx, y + dy)) continue;
        const std::uint8_t id = frame.surface.at(x + dx, y + dy);
        if (id == Frame::kNoSurface || asked[id]) continue;
        asked[id] = true;
        for (std::size_t i = 0; i < frame.lights.size() && !right; ++i) {
          const Light& light = frame.lights[i];
          const Eigen::Vector2f lit = through(light.projector_from_camera[id], point.camera_u, point.camera_v);
          const int row = static_cast<int>(std::floor((lit.y() + 0.5F) / pitch)),
                    column = static_cast<int>(std::floor((lit.x() + 0.5F) / pitch));
          if (!light.shown.contains(row, column)) continue;
          const auto& source = light.shown.source[light.shown.index(row, column)];
          right = i == 0 && source[0] == point.row && source[1] == point.column;
          undecidable_here |= undecidable(frame, light, id, row, column, point, tolerance_px) ||
                              is_side_alike(light, id, row, column, point);
        }
      }
    }
    if (right) {
      ++verdict.right;
    } else if (undecidable_here) {
      ++verdict.undecidable;
    } else {
      ++verdict.wrong;
      verdict.wrong_points.push_back(point);
    }
  }
  const Light& first = frame.lights[0];
  for (std::size_t id = 0; id < first.projector_from_camera.size(); ++id) {
    const Eigen::Matrix3f camera_from_projector = first.projector_from_camera[id].inverse();
    for (int row = 0; row < first.shown.rows; ++row) {
      for (int column = 0; column < first.shown.columns; ++column) {
        if (first.shown.source[first.shown.index(row, column)][0] < 0) continue;
        const auto left = static_cast<float>(pattern_.symbol_left_px(column)),
                   top = static_cast<float>(pattern_.symbol_top_px(row)),
                   side = static_cast<float>(pattern_.options.symbol_size_px - 1);
        bool whole_seen = true;
        for (const auto& [u, v] :
             {std::pair(left, top), {left + side, top}, {left, top + side}, {left + side, top + side}}) {
          const Eigen::Vector2f seen = through(camera_from_projector, u, v);
          const int x = static_cast<int>(std::lround(seen.x())), y = static_cast<int>(std::lround(seen.y()));
          whole_seen = whole_seen && frame.surface.view().contains(x, y) && frame.surface.at(x, y) == id;
        }
        verdict.visible += whole_seen;
      }
    }
  }
  return verdict;
}

}  // namespace slsd::adversary
