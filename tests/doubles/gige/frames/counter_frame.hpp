// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/image.hpp"

namespace slsd::test {

/// What a frame's bytes are to be: little-endian, 1 or 2 bytes a pixel, of which `bits` are used.
struct ExposureRequest {
  int width_px = 0;
  int height_px = 0;
  int bits = 8;
  std::uint32_t counter = 0;  ///< of exposures, from 0
};

/// Fills the pixels of one exposure. The vector is reused and comes in with the size of the frame before.
using ExposureSource = std::function<void(const ExposureRequest&, std::vector<std::uint8_t>& pixels)>;

/// A source of frames in which every pixel depends on the counter, and the first four pixels hold it.
[[nodiscard]] ExposureSource counter_frames();

/// A source that shows the images one after another, from the first again after the last; 8 bits. Pixels beyond an
/// image are black.
[[nodiscard]] ExposureSource replayed_images(std::vector<Grey8> images);

/// The counter of the exposure, if every pixel is as counter_frames() made it.
/// @param bits  as the camera sent them
[[nodiscard]] std::optional<std::uint32_t> counter_of(const GreyView& image, int bits = 8);

}  // namespace slsd::test
