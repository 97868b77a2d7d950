// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/image.hpp"
#include "core/result.hpp"
#include "drivers/projector/light_curve.hpp"

namespace slsd {

/// Draws a grey image with OpenGL ES 3 so that texel (x, y) becomes pixel (x, y), with the first row on top: no filter,
/// no dithering, no sRGB, no scaling. Its OpenGL objects belong to the context that was current at construction, and
/// end with it.
/// @thread thread-bound: the same context must be current in every call
class TexelPainter {
 public:
  /// @errors kUnsupported: the context cannot draw an image this large, or not exactly
  /// @param curve  maps each grey value; with the identity every value is exact
  [[nodiscard]] static Result<TexelPainter> create(int width_px, int height_px, const LightCurve& curve);

  /// Sets the image for the next draws. @param image  in the painter's size
  void load(const Grey8& image);

  /// Draws the image over the whole current framebuffer, and waits until it is drawn.
  void draw();

  /// Reads the green channel of the current framebuffer.
  [[nodiscard]] Grey8 read() const;

 private:
  TexelPainter(int width_px, int height_px, const LightCurve& curve)
      : width_px_(width_px), height_px_(height_px), curve_(curve) {}
  [[nodiscard]] Result<> make_program();
  void make_texture();

  int width_px_;
  int height_px_;
  LightCurve curve_;
  unsigned program_ = 0;
  unsigned texture_ = 0;
};

}  // namespace slsd
