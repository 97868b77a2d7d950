// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>

#include "core/result.hpp"

namespace slsd {

/// A framebuffer of 8-bit RGBA that no display shows, and its own OpenGL ES 3 context (EGL_MESA_platform_surfaceless).
/// Needs neither a graphics card nor a display: without a card Mesa draws on the processor.
/// @thread one at a time; the context is current on a thread only between use() and the end of what that returns
class OffscreenTarget {
 public:
  /// Gives the context back to other threads at its end.
  class [[nodiscard]] Use {
   public:
    explicit Use(const OffscreenTarget& target) : target_(target) {}
    ~Use();
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    const OffscreenTarget& target_;
  };

  /// @errors kUnsupported: no EGL without a display, or the size is too large for it
  [[nodiscard]] static Result<std::unique_ptr<OffscreenTarget>> create(int width_px, int height_px);
  ~OffscreenTarget();
  OffscreenTarget(const OffscreenTarget&) = delete;
  OffscreenTarget& operator=(const OffscreenTarget&) = delete;

  /// Makes context and framebuffer current on this thread.
  Use use() const;

 private:
  OffscreenTarget(void* display, void* context) : display_(display), context_(context) {}
  [[nodiscard]] Result<> make_framebuffer(int width_px, int height_px);

  void* display_;
  void* context_;
};

}  // namespace slsd
