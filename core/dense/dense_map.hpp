// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string_view>
#include <vector>

#include "core/geometry/measured_box.hpp"

namespace slsd {

/// Status of a camera pixel. All but kMeasured are reasons why it has no point.
enum class DensePixel : std::uint8_t {
  kMeasured,
  kNotReached,  ///< no patch near it fits the pattern: shadow, background, or a surface without a decoded symbol
  kNoSupport,   ///< its surroundings contradict every nearby surface
  kSaturated,   ///< it is at the camera's full level
  kOutOfDepthRange,
  kOccluded,        ///< another surface, nearer to the projector, receives the light of its projector pixel
  kUnlit,           ///< dark where the pattern is dark, at a boundary: there is no evidence for the surface
  kSmallComponent,  ///< too few connected pixels
  kAtAnEdge,        ///< closer to a hole or a jump than dense_prune_px
  kOutsideBox,      ///< outside the box to measure
  kThinned,         ///< another point stands for it: stride, voxel_mm
  kBehindPlane,     ///< on the plane to subtract, or behind it
};
inline constexpr int kDensePixelCount = 12;
/// Change of depth between adjacent pixels, as a share of the depth, above which there is a jump to another surface.
inline constexpr float kDepthJump = 0.004F;

/// "no_support", as in the counters of a reply.
[[nodiscard]] std::string_view to_string(DensePixel pixel);

/// A camera's measurement: a value for each of its pixels, row by row. A pixel without one has depth and sigma NaN, and
/// intensity 0.
struct DenseMap {
  int width = 0, height = 0;
  std::vector<float> depth_mm;          ///< along the camera's z axis
  std::vector<float> sigma_mm;          ///< one standard deviation along the pixel's ray
  std::vector<std::uint8_t> intensity;  ///< light that the surface reflects under projector white
  std::vector<DensePixel> pixels;
  std::vector<std::uint8_t> firm;  ///< 1 if the pixel itself shows the expected light, or all pixels around it do
  std::array<std::uint32_t, kDensePixelCount> counts{};  ///< pixels by their status
  PixelRectangle part;                                   ///< all pixels outside it are kOutsideBox

  /// Resizes the map; its contents are then undefined.
  void resize(int to_width, int to_height) {
    width = to_width, height = to_height;
    part = {0, 0, width, height};
    const std::size_t count = static_cast<std::size_t>(width) * height;
    depth_mm.resize(count), sigma_mm.resize(count), intensity.resize(count), pixels.resize(count), firm.resize(count);
  }
  /// Clears pixels: nothing is measured there.
  void clear(std::size_t first, int count, DensePixel why = DensePixel::kNotReached) {
    const auto fill = [&](auto& values, auto none) {
      std::fill_n(values.begin() + static_cast<std::ptrdiff_t>(first), count, none);
    };
    fill(depth_mm, std::numeric_limits<float>::quiet_NaN()), fill(sigma_mm, std::numeric_limits<float>::quiet_NaN());
    fill(intensity, std::uint8_t{0}), fill(pixels, why), fill(firm, std::uint8_t{0});
  }
  void reset(int to_width, int to_height) {
    resize(to_width, to_height);
    clear(0, width * height);
  }
  [[nodiscard]] std::size_t bytes() const {
    return depth_mm.capacity() * sizeof(float) + sigma_mm.capacity() * sizeof(float) + intensity.capacity() +
           pixels.capacity() + firm.capacity();
  }
  /// Makes this the map of a frame of which only a part was measured, from the map of that part and some around it.
  /// @param left, top  place in this map of the other's first pixel
  void take_part(const DenseMap& measured, int left, int top, const PixelRectangle& of_frame, int to_width,
                 int to_height);
  void count_pixels();
  void drop(std::size_t pixel, DensePixel why) {
    depth_mm[pixel] = sigma_mm[pixel] = std::numeric_limits<float>::quiet_NaN();
    intensity[pixel] = 0;
    pixels[pixel] = why;
  }
  [[nodiscard]] bool measured(std::size_t pixel) const { return pixels[pixel] == DensePixel::kMeasured; }
  [[nodiscard]] std::uint32_t count(DensePixel pixel) const { return counts[static_cast<std::size_t>(pixel)]; }
};

}  // namespace slsd
