// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <vector>

#include "core/cloud/cloud.hpp"
#include "core/code/pattern.hpp"
#include "core/geometry/calibration.hpp"
#include "tests/adversary/scenes/depth_scene.hpp"
#include "tests/adversary/scenes/scene_kinds.hpp"
#include "tests/adversary/scenes/scene_light.hpp"

namespace slsd::adversary {

struct SceneFrame {
  Grey8 image;
  SceneTruth truth;
};

struct SceneVerdict {
  int right = 0;
  int wrong = 0;       ///< points of a cell that is not shown there, over 40 mm off every surface
  int in_the_air = 0;  ///< other points over 5 mm off every surface
  int decoded = 0;     ///< symbols that are visible and have a right point
  int visible = 0;     ///< symbols that the camera sees whole on one surface, not too much from the side
  std::vector<CloudPoint> wrong_points;
};

/// Draws frames of scenes, and compares points with what each pixel sees.
/// @thread reentrant
class SceneFrameMaker {
 public:
  /// @param rig  the first camera takes the frames; lenses may have distortion
  SceneFrameMaker(const Pattern& pattern, Calibration rig);

  /// The same kind and number give the same frame.
  /// @param kind   index in scene_kinds()
  /// @param clean  takes the picture of the same scene by SceneLight::clean()
  [[nodiscard]] SceneFrame make(int kind, std::uint32_t number, bool clean = false) const;
  [[nodiscard]] SceneFrame take(const DepthScene& scene, const SceneLight& light, Random& random) const;

  [[nodiscard]] SceneVerdict judge(const SceneTruth& truth, const std::vector<CloudPoint>& points) const;

  /// Whether the camera sees each symbol whole, row by row.
  [[nodiscard]] std::vector<bool> visible_symbols(const SceneTruth& truth) const;

 private:
  Pattern pattern_;
  Calibration rig_;
  Grey8 shown_;
  std::vector<float> noise_;
};

}  // namespace slsd::adversary
