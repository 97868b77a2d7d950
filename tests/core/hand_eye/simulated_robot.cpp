// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/core/hand_eye/simulated_robot.hpp"

#include <cmath>
#include <cstdlib>

#include <Eigen/Geometry>

namespace slsd {
namespace {

class Draw {
 public:
  explicit Draw(std::mt19937& random) : random_(random) {}
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  double normal() { return std::normal_distribution<double>()(random_); }
  Eigen::Vector3d normal3() {
    const double x = normal(), y = normal(), z = normal();
    return {x, y, z};
  }
  Eigen::Vector3d box(double low, double high) {
    const double x = between(low, high), y = between(low, high), z = between(low, high);
    return {x, y, z};
  }

 private:
  std::mt19937& random_;
};

CalibratedCamera some_camera(Draw& draw) {
  CalibratedCamera camera;
  camera.name = "left";
  camera.lens = {1600, 1200, 2000, 2000, 800, 600, {}};
  camera.lens.fx += draw.between(-100, 100);
  camera.lens.fy = camera.lens.fx;
  camera.lens.cx += draw.between(-20, 20), camera.lens.cy += draw.between(-20, 20);
  camera.lens.distortion = {draw.between(-0.15, 0.05), draw.between(-0.05, 0.05), 0.0005 * draw.normal(),
                            0.0005 * draw.normal(), 0};
  return camera;
}

// The board in the rig: near the middle of the picture, tilted to any side, rolled about the line of sight.
RigidTransform some_view(const SimulatedRobot& robot, const Lens& lens, const Board& board, Draw& draw) {
  const double distance = draw.between(robot.distance_min_mm, robot.distance_max_mm);
  const double tilt = draw.between(0.3, 1) * robot.turn_max_rad, side = draw.between(0, 6.2832);
  const double roll = draw.between(-robot.roll_max_rad, robot.roll_max_rad);
  const Eigen::Matrix3d turn =
      robot.one_axis ? turned_by({0, 0, draw.between(-1, 1)})
                     : Eigen::Matrix3d(turned_by({0, 0, roll}) *
                                       turned_by(tilt * Eigen::Vector3d(std::cos(side), std::sin(side), 0)));
  const double reach = 0.7 * (0.5 * lens.height_px / lens.fy * distance - 0.5 * board.height_mm());
  const Eigen::Vector3d middle(draw.between(-reach, reach), draw.between(-reach, reach), distance);
  const Eigen::Vector3d on_board(board.width_mm() / 2, board.height_mm() / 2, 0);
  return {turn, middle - turn * on_board};
}

}  // namespace

Eigen::Matrix3d turned_by(const Eigen::Vector3d& vector_rad) {
  const double angle = vector_rad.norm();
  return angle > 0 ? Eigen::AngleAxisd(angle, vector_rad / angle).toRotationMatrix() : Eigen::Matrix3d::Identity();
}

std::vector<CameraSighting> look_at_board(const Calibration& truth, const Board& board,
                                          const RigidTransform& rig_from_board, double corner_px,
                                          std::mt19937& random) {
  Draw draw(random);
  CameraSighting seen;
  const Lens& lens = truth.cameras.front().lens;
  for (int id = 0; id < board.point_count(); ++id) {
    const Eigen::Vector3d there = rig_from_board * board.point(id);
    if (there.z() <= 0) continue;
    Eigen::Vector2d pixel = lens.project(there);
    pixel.x() += corner_px * draw.normal();
    pixel.y() += corner_px * draw.normal();
    if (pixel.x() < 0 || pixel.y() < 0 || pixel.x() > lens.width_px - 1 || pixel.y() > lens.height_px - 1) continue;
    seen.sighting.points.push_back({id, pixel});
  }
  return {seen};
}

void locate_all(SimulatedSession& simulated) {
  std::vector<LocatedBoard> boards;
  for (std::size_t i = 0; i < simulated.sightings.size(); ++i) {
    const auto located = locate_board(simulated.sightings[i], simulated.board, simulated.calibration);
    if (!located) std::abort();
    simulated.session.views[i].board = *located;
    boards.push_back(*located);
  }
  simulated.session.corner_px = corner_noise_px(boards);
}

SimulatedSession simulate(const SimulatedRobot& robot, std::uint32_t seed) {
  std::mt19937 random(seed);
  Draw draw(random);
  SimulatedSession simulated;
  simulated.board = *parse_board("charuco:11x7:23:17.25:DICT_5X5_1000");
  simulated.truth.cameras.push_back(some_camera(draw));
  simulated.calibration = simulated.truth;
  Lens& lens = simulated.calibration.cameras.front().lens;
  const double focal_error = robot.focal_px * draw.normal();
  lens.fx += focal_error, lens.fy += focal_error;
  lens.cx += robot.focal_px * draw.normal(), lens.cy += robot.focal_px * draw.normal();
  const double sigma = robot.focal_px;
  simulated.calibration.report.camera_sigma = {{sigma, sigma, sigma, sigma, 0, 0, 0, 0, 0}};
  const Board printed = simulated.board.scaled(1 + robot.print_scale * draw.normal());

  const bool arm = robot.mounted == Mounted::kArm;
  // On the flange: beside it, looking along its z. In the cell: a metre away, any way round.
  const RigidTransform held{turned_by(0.3 * draw.normal3()) * turned_by({0, 0, draw.between(-3, 3)}),
                            {draw.between(-100, 100), draw.between(-100, 100), draw.between(20, 150)}};
  const RigidTransform standing{turned_by(draw.box(-1.5, 1.5)), draw.box(-300, 300) + Eigen::Vector3d(900, 0, 200)};
  simulated.places = arm ? HandEyePlaces{held, standing} : HandEyePlaces{standing, held};
  simulated.session.mounted = robot.mounted;
  simulated.session.shared = SharedErrors::of(simulated.calibration, robot.print_scale);
  for (int i = 0; i < robot.poses; ++i) {
    const RigidTransform rig_from_board = some_view(robot, simulated.truth.cameras.front().lens, printed, draw);
    const RigidTransform mount_from_stand =
        simulated.places.mount_from_rig.after(rig_from_board).after(simulated.places.stand_from_board.inverse());
    const RigidTransform base_from_flange = arm ? mount_from_stand.inverse() : mount_from_stand;
    simulated.base_from_flange.push_back(base_from_flange);
    simulated.sightings.push_back(look_at_board(simulated.truth, printed, rig_from_board, robot.corner_px, random));
    HandEyeView view;
    view.name = "pose_" + std::to_string(100 + i).substr(1);
    view.base_from_flange = {turned_by(robot.noise.turn_rad * draw.normal3()) * base_from_flange.rotation,
                             base_from_flange.translation + robot.noise.place_mm * draw.normal3()};
    simulated.session.views.push_back(view);
  }
  locate_all(simulated);
  return simulated;
}

}  // namespace slsd
