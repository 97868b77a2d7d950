// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/core/calibrate/synthetic_rig.hpp"

#include <random>
#include <string>

#include <Eigen/Geometry>

namespace slsd {
namespace {

constexpr int kCornerColumns = 10, kCornerRows = 7;
constexpr int kSymbolColumns = 20, kSymbolRows = 14;
constexpr double kBoardSquareMm = 50, kSymbolPitchMm = 25;

struct Sight {
  const RigModel& rig;
  const SightOptions& options;
  std::mt19937 random;

  [[nodiscard]] Eigen::Vector3d in_rig(int pose, const MotionVector& rig_from_board, const Eigen::Vector2d& mm) const {
    const double relief = options.relief ? options.relief(pose, mm) : 0;
    return to_motion(rig_from_board) * Eigen::Vector3d(mm.x(), mm.y(), relief);
  }

  Eigen::Vector2d noisy(const Eigen::Vector2d& pixel, double sigma_px) {
    std::normal_distribution<double> noise(0, sigma_px);
    const double x = noise(random), y = noise(random);
    return pixel + Eigen::Vector2d(x, y);
  }

  PoseView look(std::size_t index, int pose, const MotionVector& rig_from_board) {
    const DeviceModel& device = rig.cameras[index];
    const Lens camera = to_lens(device.lens, device.size), projector = to_lens(rig.projector.lens, rig.projector.size);
    const RigidTransform camera_from_rig = to_motion(device.device_from_rig),
                         projector_from_rig = to_motion(rig.projector.device_from_rig);
    PoseView view;
    view.camera = index, view.blur_px = 0.5;
    for (int i = 0; i < kCornerColumns * kCornerRows; ++i) {
      const Eigen::Vector2d mm = kBoardSquareMm * Eigen::Vector2d(i % kCornerColumns, i / kCornerColumns);
      const Eigen::Vector2d printed(mm.x(), mm.y() * (1 + options.stretch));
      const Eigen::Vector3d point = in_rig(pose, rig_from_board, printed);
      view.corners.push_back({noisy(camera.project(camera_from_rig * point), options.corner_sigma_px), mm});
    }
    Eigen::Vector2d shift = Eigen::Vector2d::Zero();
    if (options.symbol_shift_px > 0) shift = noisy(shift, options.symbol_shift_px);
    const MotionVector then = options.moved ? options.moved(pose, rig_from_board) : rig_from_board;
    for (int i = 0; i < kSymbolColumns * kSymbolRows; ++i) {
      const Eigen::Vector2d mm = kSymbolPitchMm * Eigen::Vector2d(i % kSymbolColumns, i / kSymbolColumns);
      const Eigen::Vector3d point = in_rig(pose, then, mm);
      const Eigen::Vector2d pixel = noisy(camera.project(camera_from_rig * point) + shift, options.symbol_sigma_px);
      view.symbols.push_back({pixel, projector.project(projector_from_rig * point), 0.05});
    }
    return view;
  }
};

}  // namespace

RigModel true_rig(std::size_t cameras) {
  RigModel rig;
  for (std::size_t i = 0; i < cameras; ++i) {
    rig.cameras.push_back({{1600, 1200},
                           {3555, 3553, 806, 594, -0.11, 0.09, 0.0006, -0.0005, 0},
                           {0, -0.07 * static_cast<double>(i), 0, 150.0 * static_cast<double>(i), 0, 0}});
  }
  rig.projector = {{1280, 800},
                   {2509, 2510.5, 643, 436, -0.05, 0.03, -0.0004, 0.0007, 0},
                   {0.0174, -0.0925, 0.0097, 178.4, 2.3, -23.6}};
  return rig;
}

std::vector<MotionVector> true_poses(int count, std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::vector<MotionVector> poses;
  for (int i = 0; i < count; ++i) {
    const double direction = uniform(0, 6.28), tilt = i % 4 == 0 ? uniform(0, 0.15) : uniform(0.25, 0.6);
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(tilt, Eigen::Vector3d(std::cos(direction), std::sin(direction), 0)).toRotationMatrix() *
        Eigen::AngleAxisd(uniform(-0.3, 0.3), Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const Eigen::Vector3d middle(uniform(-140, 140), uniform(-90, 90), uniform(1650, 2200));
    poses.push_back(to_vector(RigidTransform{turn, middle - turn * Eigen::Vector3d(225, 150, 0)}));
  }
  return poses;
}

Observations see(const RigModel& rig, const std::vector<MotionVector>& poses, const SightOptions& options) {
  Sight sight{rig, options, std::mt19937(options.seed)};
  Observations observations;
  observations.projector = rig.projector.size;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    observations.cameras.push_back({"camera" + std::to_string(i), rig.cameras[i].size});
  }
  for (std::size_t pose = 0; pose < poses.size(); ++pose) {
    PoseObservation& observation = observations.poses.emplace_back();
    observation.name = "pose_" + std::to_string(pose);
    for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
      observation.views.push_back(sight.look(i, static_cast<int>(pose), poses[pose]));
    }
  }
  return observations;
}

}  // namespace slsd
