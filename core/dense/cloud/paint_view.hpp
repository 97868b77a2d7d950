// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <span>

#include "core/cloud/texture_view.hpp"
#include "core/dense/cloud/dense_cloud.hpp"
#include "core/executor.hpp"

namespace slsd {

/// The surface of a camera's pixels; of every second or third one, if the camera has more than 3 million.
[[nodiscard]] MeasuredSurface surface_of(const DenseView& view);

/// Pixels of unknown colour.
struct Unpainted {
  std::size_t unseen = 0;     ///< no texture camera sees them
  std::size_t saturated = 0;  ///< those that see them are saturated, while the pixel's own intensity is not
};

/// Gives measured pixels the colours that texture cameras see, as paint() does.
/// @param surface  the view's number in each texture view
/// @thread reentrant
Unpainted paint_view(DenseView& view, std::span<const TextureView> textures, std::size_t surface, Executor& executor);

}  // namespace slsd
