// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/doubt/misreading.hpp"

#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace slsd {
namespace {

struct Unit {
  const char* name;
  double mm;
  double share;  // share of such calibrations in practice
};
constexpr std::array kUnits{Unit{"", 1, 1}, Unit{"metres", 1000, 0.01}, Unit{"centimetres", 10, 0.01},
                            Unit{"inches", 25.4, 0.003}, Unit{"micrometres", 0.001, 0.001}};

struct Direction {
  const char* advice;
  double share;
  RigidTransform meant;
};

// x to the right, y up, z backward, as OpenGL and Blender have it.
RigidTransform upside_down() {
  RigidTransform flip;
  flip.rotation.diagonal() = Eigen::Vector3d(1, -1, -1);
  return flip;
}

std::vector<Direction> directions_of(const RigidTransform& given) {
  const auto& [rotation, translation] = given;
  const RigidTransform flip = upside_down();
  return {{"", 1, given},
          {"R and T look inverted (camera_from_projector): give R transposed, and -R transposed times T", 0.01,
           given.inverse()},
          {"R looks transposed: transpose it", 0.004, {rotation.transpose(), translation}},
          {"T looks like the projector's place in the camera's frame: give -R times it",
           0.004,
           {rotation, -(rotation * translation)}},
          {"T has the wrong sign: negate it", 0.003, {rotation, -translation}},
          {"the axes look like OpenGL's (y up, z backward): negate the second and third row and column of R, and the "
           "second and third number of T",
           0.004, flip.after(given).after(flip)},
          {"the camera's axes look like OpenGL's (y up, z backward): negate the second and third column of R", 0.003,
           given.after(flip)},
          {"the projector's axes look like OpenGL's (y up, z backward): negate the second and third row of R, and the "
           "second and third number of T",
           0.003, flip.after(given)}};
}

void add_motions(const CameraRig& rig, std::vector<Misreading>& found) {
  for (const Direction& direction : directions_of(rig.camera.projector_from_camera)) {
    for (const Unit& unit : kUnits) {
      const double share = direction.share * unit.share;
      if (share == 1) continue;
      Misreading misreading{"", std::log(share), rig};
      if (unit.mm != 1) misreading.advice = fmt::format("T looks like {}: multiply it by {:g}", unit.name, unit.mm);
      if (direction.share != 1) {
        misreading.advice += (misreading.advice.empty() ? "" : ", and ") + std::string(direction.advice);
      }
      RigidTransform& meant = misreading.rig.camera.projector_from_camera;
      meant = direction.meant;
      meant.translation *= unit.mm;
      found.push_back(std::move(misreading));
    }
  }
}

void scale(Lens& lens, double factor) {
  constexpr double kToEdge = 0.5;  // from the first pixel's centre to the image's edge
  lens.fx *= factor, lens.fy *= factor;
  lens.cx = (lens.cx + kToEdge) * factor - kToEdge, lens.cy = (lens.cy + kToEdge) * factor - kToEdge;
}

// A camera matrix for larger or smaller images.
void add_sizes(const CameraRig& rig, std::vector<Misreading>& found) {
  constexpr double kShare = 0.003;
  for (const double factor : {2.0, 4.0, 1.5, 0.5, 0.25, 1 / 1.5}) {
    const auto advice = [&](const char* key, const Lens& lens) {
      return fmt::format("{} looks made for images of {:.0f}x{:.0f} px: multiply fx, fy, cx and cy by {:.4g}", key,
                         lens.width_px / factor, lens.height_px / factor, factor);
    };
    Misreading camera{advice("camera_matrix", rig.camera.lens), std::log(kShare), rig};
    scale(camera.rig.camera.lens, factor);
    Misreading projector{advice("projector_matrix", rig.projector), std::log(kShare), rig};
    scale(projector.rig.projector, factor);
    found.push_back(std::move(camera)), found.push_back(std::move(projector));
  }
}

void add_swapped(const CameraRig& rig, std::vector<Misreading>& found) {
  constexpr double kShare = 0.01;
  Misreading swapped{"camera_matrix and projector_matrix look swapped: swap them back, with their distortions",
                     std::log(kShare), rig};
  Lens &camera = swapped.rig.camera.lens, &projector = swapped.rig.projector;
  std::swap(camera, projector);
  std::swap(camera.width_px, projector.width_px), std::swap(camera.height_px, projector.height_px);
  found.push_back(std::move(swapped));
}

// Metashape and MATLAB list the radial coefficients first.
void add_distortions(const CameraRig& rig, std::vector<Misreading>& found) {
  constexpr double kShare = 0.01;
  const auto add = [&](const char* key, auto lens_of) {
    Misreading ordered{fmt::format("{} looks ordered as k1 k2 k3 p1 p2: slsd reads k1 k2 p1 p2 k3", key),
                       std::log(kShare), rig};
    auto& [k1, k2, p1, p2, k3] = lens_of(ordered.rig).distortion;
    const double third = p1;
    p1 = p2, p2 = k3, k3 = third;
    found.push_back(std::move(ordered));
  };
  add("camera_distortion", [](CameraRig& of) -> Lens& { return of.camera.lens; });
  add("projector_distortion", [](CameraRig& of) -> Lens& { return of.projector; });
}

}  // namespace

std::vector<Misreading> misreadings_of(const CameraRig& rig) {
  std::vector<Misreading> found;
  add_motions(rig, found);
  add_sizes(rig, found);
  add_swapped(rig, found);
  add_distortions(rig, found);
  return found;
}

}  // namespace slsd
