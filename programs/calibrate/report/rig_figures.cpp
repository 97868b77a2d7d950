// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/report/rig_figures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "programs/calibrate/report/svg_figure.hpp"

namespace slsd {
namespace {

constexpr double kRigPx = 460;
constexpr double kAbovePx = -8;  // offset of a label from its dot
constexpr double kBelowPx = 16;
constexpr double kNamePx = 60, kLinePx = 13;  // approximate width and height of a device's name
constexpr double kFlatMm = 0.1;               // deviation of a board that has full colour
constexpr double kDeviceMm = 120;             // distance between a device and its drawn image

using Quad = std::array<Eigen::Vector3d, 4>;
using Projection = Eigen::Matrix<double, 2, 3>;

// The figure's right and down. Right is z; from above, up is x; from the right, down is y.
Projection from_above() {
  return (Projection() << 0, 0, 1, -1, 0, 0).finished();
}
Projection from_the_right() {
  return (Projection() << 0, 0, 1, 0, 1, 0).finished();
}

Quad quad_of(const Eigen::AlignedBox2d& box, double z, const RigidTransform& motion) {
  const auto corner = [&](double x, double y) { return motion * Eigen::Vector3d(x, y, z); };
  return {corner(box.min().x(), box.min().y()), corner(box.max().x(), box.min().y()),
          corner(box.max().x(), box.max().y()), corner(box.min().x(), box.max().y())};
}

Eigen::AlignedBox2d board_box(const PoseObservation& pose) {
  Eigen::AlignedBox2d box;
  for (const PoseView& view : pose.views) {
    for (const BoardPoint& corner : view.corners) box.extend(corner.board_mm);
  }
  return box;
}

struct DrawnDevice {
  std::string name;
  Eigen::Vector3d eye;
  Quad image;
};

DrawnDevice device_of(const std::string& name, const DeviceModel& model) {
  const RigidTransform rig_from_device = to_motion(model.device_from_rig).inverse();
  const Lens lens = to_lens(model.lens, model.size);
  Eigen::AlignedBox2d box(Eigen::Vector2d(-lens.cx / lens.fx, -lens.cy / lens.fy),
                          Eigen::Vector2d((lens.width_px - lens.cx) / lens.fx, (lens.height_px - lens.cy) / lens.fy));
  box = Eigen::AlignedBox2d(box.min() * kDeviceMm, box.max() * kDeviceMm);
  return {name, rig_from_device.translation, quad_of(box, kDeviceMm, rig_from_device)};
}

std::vector<DrawnDevice> devices_of(const CalibrationOutcome& outcome) {
  std::vector<DrawnDevice> devices{device_of("projector", outcome.rig.projector)};
  for (std::size_t i = 0; i < outcome.rig.cameras.size(); ++i) {
    devices.push_back(device_of(outcome.observations.cameras[i].name, outcome.rig.cameras[i]));
  }
  return devices;
}

std::vector<Quad> boards_of(const CalibrationOutcome& outcome) {
  std::vector<Quad> boards;
  for (std::size_t i = 0; i < outcome.observations.poses.size(); ++i) {
    boards.push_back(quad_of(board_box(outcome.observations.poses[i]), 0, to_motion(outcome.rig.rig_from_board[i])));
  }
  return boards;
}

void draw_quad(SvgFigure& figure, const Projection& look, const Quad& quad, std::string_view colour, double width_px) {
  for (std::size_t i = 0; i < 4; ++i) figure.line(look * quad[i], look * quad[(i + 1) % 4], colour, width_px);
}

std::string poses_figure(const CalibrationOutcome& outcome, const Projection& look, std::string_view caption) {
  const auto devices = devices_of(outcome);
  const auto boards = boards_of(outcome);
  Eigen::AlignedBox2d box;
  for (const auto& device : devices) {
    box.extend(look * device.eye);
    for (const auto& corner : device.image) box.extend(look * corner);
  }
  for (const auto& board : boards) {
    for (const auto& corner : board) box.extend(look * corner);
  }
  const Eigen::Vector2d border = Eigen::Vector2d::Constant(0.05 * box.sizes().maxCoeff());
  SvgFigure figure(box.min() - border, box.max() + border, kRigPx);
  for (std::size_t i = 0; i < boards.size(); ++i) draw_quad(figure, look, boards[i], pose_colour(i), 1.6);
  std::vector<Eigen::Vector2d> named;
  for (const auto& device : devices) {
    draw_quad(figure, look, device.image, "#333", 1);
    for (const auto& corner : device.image) figure.line(look * device.eye, look * corner, "#333", 1);
    Eigen::Vector2d at = look * device.image[0] + 0.15 * border;
    // Placed below names that are already there.
    for (const Eigen::Vector2d& other : named) {
      const Eigen::Vector2d apart = figure.scale() * (at - other).cwiseAbs();
      if (apart.x() < kNamePx && apart.y() < kLinePx) at.y() = other.y() + kLinePx / figure.scale();
    }
    named.push_back(at);
    figure.text(at, device.name);
  }
  figure.frame();
  return figure.str(fmt::format("{}; the figure is {:.0f} mm wide", caption, box.sizes().x() + 2 * border.x()));
}

double largest_mm(const std::vector<DepthUncertainty>& depths) {
  double largest = 1e-3;
  for (const auto& depth : depths) largest = std::max({largest, depth.calibration_mm, depth.noise_mm});
  return largest;
}

// The largest height fills the figure.
void draw_curve(SvgFigure& figure, const std::vector<DepthUncertainty>& depths, double DepthUncertainty::*what,
                double unit, std::string_view colour, double label_px) {
  for (std::size_t i = 0; i < depths.size(); ++i) {
    const Eigen::Vector2d at(depths[i].depth_mm, -unit * depths[i].*what);
    figure.dot(at, 3, colour);
    if (i > 0) figure.line({depths[i - 1].depth_mm, -unit * depths[i - 1].*what}, at, colour, 1.5);
    figure.text(at + Eigen::Vector2d(0, label_px / figure.scale()), fmt::format("{:.3f}", depths[i].*what), "middle");
  }
}

}  // namespace

std::string poses_from_above(const CalibrationOutcome& outcome) {
  return poses_figure(outcome, from_above(), "from above: the rig looks to the right, its right side is up");
}

std::string poses_from_the_right(const CalibrationOutcome& outcome) {
  return poses_figure(outcome, from_the_right(), "from its right side: the rig looks to the right");
}

std::string board_figure(const CalibrationOutcome& outcome) {
  constexpr int kAcross = 28;
  const BoardReport& board = outcome.board;
  if (board.sheet_mm.isEmpty()) return {};
  const int down = std::max(1, static_cast<int>(kAcross * board.sheet_mm.sizes().y() / board.sheet_mm.sizes().x()));
  const Eigen::Vector2d cell = board.sheet_mm.sizes().cwiseQuotient(Eigen::Vector2d(kAcross, down));
  const auto first_of = [&](int column, int row) -> Eigen::Vector2d {
    return board.sheet_mm.min() + cell.cwiseProduct(Eigen::Vector2d(column, row));
  };
  std::vector<double> heights;
  for (int i = 0; i < kAcross * down; ++i) {
    heights.push_back(board.shape.height_mm(first_of(i % kAcross, i / kAcross) + 0.5 * cell));
  }
  const auto [lowest, highest] = std::ranges::minmax(heights);
  const double middle = 0.5 * (lowest + highest), half = std::max(0.5 * (highest - lowest), kFlatMm);
  SvgFigure figure(board.sheet_mm.min(), board.sheet_mm.max(), kRigPx);
  for (int i = 0; i < kAcross * down; ++i) {
    const double share = (heights[static_cast<std::size_t>(i)] - middle) / half;
    const Eigen::Vector2d first = first_of(i % kAcross, i / kAcross);
    figure.rectangle(first, first + cell,
                     fmt::format("hsl({}, 70%, {:.0f}%)", share < 0 ? 215 : 10, 97 - 45 * std::abs(share)));
  }
  figure.frame();
  return figure.str(
      fmt::format("The board's shape from the front: blue is {:.2f} mm nearer to the viewer than the mean height, red "
                  "{:.2f} mm farther",
                  half, half));
}

std::string depth_figure(const CalibrationOutcome& outcome) {
  const auto& depths = outcome.depth;
  if (depths.size() < 2) return {};
  const double range = depths.back().depth_mm - depths.front().depth_mm;
  const double unit = 0.35 * range / largest_mm(depths);
  const Eigen::Vector2d first(depths.front().depth_mm - 0.1 * range, -0.45 * range);
  const Eigen::Vector2d last(depths.back().depth_mm + 0.1 * range, 0.1 * range);
  SvgFigure figure(first, last, kRigPx);
  figure.line({first.x(), 0}, {last.x(), 0}, "#888");
  for (const auto& depth : depths) {
    figure.text({depth.depth_mm, 0.06 * range}, fmt::format("{:.0f} mm", depth.depth_mm), "middle");
  }
  draw_curve(figure, depths, &DepthUncertainty::noise_mm, unit, "#888", kBelowPx);
  draw_curve(figure, depths, &DepthUncertainty::calibration_mm, unit, "#06c", kAbovePx);
  figure.frame();
  return figure.str(
      "one standard deviation of a depth, in mm: blue from the calibration, grey from the noise of one symbol");
}

}  // namespace slsd
