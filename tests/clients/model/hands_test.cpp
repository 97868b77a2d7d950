// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <iterator>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "clients/model/build_model.hpp"
#include "hand.hpp"

namespace slsd::model {
namespace {

constexpr float kSigmaMm = 0.1F;
constexpr int kStepDegrees = 10, kClouds = 36;

/// The mesh of a turn, and how well each cloud is placed.
struct Turn {
  Model model;
  double worst_place_mm = 0;
};

/// @param scene_at  what the camera sees at a cloud: distance in the ball's frame
template <class SceneAt>
Turn turn_once(SceneAt&& scene_at) {
  const Calibration calibration = wide_calibration();
  ModelOptions options;
  options.voxel_mm = 0.7F;
  ModelBuilder builder(calibration, options);
  std::map<std::string, std::string> clouds;
  std::map<std::string, int> numbers;
  for (int i = 0; i < kClouds; ++i) {
    const std::string name = std::to_string(i);
    numbers[name] = i;
    clouds[name] = ply_of(measure(scene_at(i), rig_from_object(kStepDegrees * i), kSigmaMm, static_cast<unsigned>(i),
                                  calibration.cameras[0].lens));
    const auto added = builder.add(name, clouds[name]);
    EXPECT_TRUE(added.has_value());
    if (!added->refusal.empty()) std::printf("%d: %s\n", i, added->refusal.c_str());
  }
  auto model = builder.finish([&](const std::string& name) -> Result<std::string> { return clouds[name]; },
                              [](const std::string& told) { std::puts(told.c_str()); });
  EXPECT_TRUE(model.has_value());
  Turn done{std::move(*model), 0};
  for (const FusedFrame& frame : done.model.report.fused) {
    const RigidTransform truth =
        rig_from_object(0).after(rig_from_object(kStepDegrees * numbers[frame.name]).inverse());
    done.worst_place_mm =
        std::max(done.worst_place_mm,
                 apart_mm(frame.object_from_rig.after(truth.inverse()).after(rig_from_object(0)), rig_from_object(0)));
  }
  return done;
}

/// Number of vertices farther than so much off the ball.
std::size_t farther_than(const Mesh& mesh, float mm) {
  return static_cast<std::size_t>(std::ranges::count_if(mesh.vertices_mm, [&](const Eigen::Vector3f& vertex) {
    return std::abs(off_ball_mm(vertex - kMiddle.cast<float>())) > mm;
  }));
}

/// Share of the ball's surface between 50 degrees up and down from which a vertex is within 1.5 mm.
double share_in(const Mesh& mesh) {
  static constexpr float kNearMm = 1.5F, kDegree = 3.14159265F / 180;
  using Cube = std::array<int, 3>;
  const auto cube_of = [](const Eigen::Vector3f& at) {
    const Eigen::Vector3f cube = (at / kNearMm).array().floor();
    return Cube{static_cast<int>(cube.x()), static_cast<int>(cube.y()), static_cast<int>(cube.z())};
  };
  std::map<Cube, std::vector<Eigen::Vector3f>> cubes;
  for (const Eigen::Vector3f& vertex : mesh.vertices_mm) {
    const Eigen::Vector3f at = vertex - kMiddle.cast<float>();
    cubes[cube_of(at)].push_back(at);
  }
  const auto is_there = [&](const Eigen::Vector3f& at) {
    const Cube middle = cube_of(at);
    for (int i = 0; i < 27; ++i) {
      const auto found = cubes.find({middle[0] + i % 3 - 1, middle[1] + i / 3 % 3 - 1, middle[2] + i / 9 - 1});
      if (found == cubes.end()) continue;
      for (const Eigen::Vector3f& vertex : found->second)
        if ((vertex - at).norm() < kNearMm) return true;
    }
    return false;
  };
  int there = 0, all = 0;
  for (float down = -50; down <= 50; down += 2) {
    for (float side = 0; side < 360; side += 2) {
      const Eigen::Vector3f along(std::sin(side * kDegree) * std::cos(down * kDegree), std::sin(down * kDegree),
                                  std::cos(side * kDegree) * std::cos(down * kDegree));
      float far_mm = 50;
      for (int step = 0; step < 20; ++step) far_mm -= bumpy_ball(far_mm * along);
      ++all, there += is_there(far_mm * along) ? 1 : 0;
    }
  }
  return static_cast<double>(there) / all;
}

/// The cloud at which each grip begins; each lasts for 5 to 8.
constexpr std::array kGrips{0, 5, 13, 19, 26, 31};

/// The hand moves with the ball from where the grip begins, 30 degrees to one side of the camera.
Distance held(int cloud) {
  const int begin = *std::prev(std::ranges::upper_bound(kGrips, cloud));
  const Eigen::Matrix3f then = turned(static_cast<float>(kStepDegrees * begin) - 30);
  return [then](const Eigen::Vector3f& at) { return std::min(bumpy_ball(at), hand(then * at)); };
}

/// Passes before the ball from one side to the other during four clouds.
Distance passed(int cloud) {
  const int since = cloud - 12;
  if (since < 0 || since > 3) return bumpy_ball;
  const Eigen::Matrix3f then = turned(static_cast<float>(kStepDegrees * cloud));
  const Eigen::Vector3f shift(45.0F * static_cast<float>(since) - 70, -20, -22);
  return [then, shift](const Eigen::Vector3f& at) { return std::min(bumpy_ball(at), hand(then * at - shift)); };
}

double share_of_hand(const Distance& scene, int cloud) {
  std::size_t of_hand = 0, all = 0;
  const RigidTransform object_from_rig = rig_from_object(kStepDegrees * cloud).inverse();
  for (const DensePoint& point :
       measure(scene, rig_from_object(kStepDegrees * cloud), kSigmaMm, 1, wide_calibration().cameras[0].lens))
    ++all, of_hand += std::abs(off_ball_mm((object_from_rig * point.place_mm.cast<double>()).cast<float>())) > 2;
  return static_cast<double>(of_hand) / static_cast<double>(all);
}

/// The mesh is that of the ball alone, and almost all of it. Prints how far it is.
/// @param most_share     of vertices farther than 2 mm from the ball
/// @param least_of_ball  share of the ball that is there
void expect_ball(const Turn& turn, double most_share, double least_of_ball) {
  float most = 0;
  for (const Eigen::Vector3f& vertex : turn.model.mesh.vertices_mm)
    most = std::max(most, std::abs(off_ball_mm(vertex - kMiddle.cast<float>())));
  const double share = share_in(turn.model.mesh);
  std::printf(
      "%zu vertices, %zu farther than 2 mm, at most %.1f mm; %.2f %% of the ball; places off by up to %.2f mm; %zu "
      "fused\n",
      turn.model.mesh.vertices_mm.size(), farther_than(turn.model.mesh, 2), most, 100 * share, turn.worst_place_mm,
      turn.model.report.fused.size());
  EXPECT_LE(static_cast<double>(farther_than(turn.model.mesh, 2)),
            most_share * static_cast<double>(turn.model.mesh.vertices_mm.size()));
  EXPECT_GT(share, least_of_ball);
  EXPECT_LT(turn.worst_place_mm, 0.6);
  EXPECT_EQ(turn.model.report.fused.size(), kClouds);
}

TEST(Hands, ThatHoldAndRegripAreNoPartOfTheObject) {
  EXPECT_GT(share_of_hand(held(0), 0), 0.3);
  expect_ball(turn_once(held), 0.01, 0.98);
}

TEST(Hands, ThatPassAreNoPartOfTheObject) {
  EXPECT_GT(share_of_hand(passed(13), 13), 0.4);
  expect_ball(turn_once(passed), 0, 0.995);
}

}  // namespace
}  // namespace slsd::model
