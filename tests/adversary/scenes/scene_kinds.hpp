// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <string_view>

#include "tests/adversary/random_numbers.hpp"
#include "tests/adversary/scenes/depth_scene.hpp"

namespace slsd::adversary {

/// Scenes of one kind whose edges in depth do not follow the pattern's grid.
struct SceneKind {
  std::string_view name;
  bool kept_out;  ///< never looked at while the decoder is tuned
  /// Draws a scene.
  /// @param symbol_mm  from one symbol to the next, at a depth of 2 m
  DepthScene (*lay)(Random& random, double symbol_mm);
};

/// All of them, in the order of their numbers: add a kind at the end.
[[nodiscard]] std::span<const SceneKind> scene_kinds();

}  // namespace slsd::adversary
