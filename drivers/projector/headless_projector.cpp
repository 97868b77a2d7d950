// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/headless_projector.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <thread>
#include <utility>

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GLES3/gl3.h>

#include "core/image_size.hpp"
#include "drivers/projector/texel_painter.hpp"

namespace slsd {
namespace {

constexpr int kSideMaxPx = 16384;

tl::unexpected<Error> unsupported(const std::string& what) {
  return fail(ErrorCode::kUnsupported, "cannot draw without a display: " + what +
                                           "; install Mesa's EGL (libegl1, libegl-mesa0, libgl1-mesa-dri)");
}

// The display is the process's, shared by all targets: ending it for one would end it for all, so that nobody does.
Result<EGLDisplay> surfaceless_display() {
  const EGLDisplay display = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  if (display == EGL_NO_DISPLAY) return unsupported("EGL lacks EGL_MESA_platform_surfaceless");
  if (eglInitialize(display, nullptr, nullptr) != EGL_TRUE) return unsupported("EGL does not start");
  if (eglBindAPI(EGL_OPENGL_ES_API) != EGL_TRUE) return unsupported("EGL lacks OpenGL ES");
  return display;
}

Result<EGLContext> make_context(EGLDisplay display) {
  const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_ES3_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint found = 0;
  if (eglChooseConfig(display, wanted, &config, 1, &found) != EGL_TRUE || found < 1) {
    return unsupported("EGL has no configuration for OpenGL ES 3");
  }
  const EGLint version[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_NONE};
  const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, version);
  if (context == EGL_NO_CONTEXT) return unsupported("EGL makes no context");
  return context;
}

}  // namespace

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

Result<std::unique_ptr<OffscreenTarget>> OffscreenTarget::create(int width_px, int height_px) {
  const auto display = surfaceless_display();
  if (!display) return tl::unexpected(display.error());
  const auto context = make_context(*display);
  if (!context) return tl::unexpected(context.error());
  std::unique_ptr<OffscreenTarget> target(new OffscreenTarget(*display, *context));
  if (auto made = target->make_framebuffer(width_px, height_px); !made) return tl::unexpected(made.error());
  return target;
}

OffscreenTarget::~OffscreenTarget() {
  eglDestroyContext(display_, context_);
}

Result<> OffscreenTarget::make_framebuffer(int width_px, int height_px) {
  const Use current = use();
  GLuint colour = 0;
  GLuint framebuffer = 0;
  glGenRenderbuffers(1, &colour);
  glBindRenderbuffer(GL_RENDERBUFFER, colour);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, width_px, height_px);
  glGenFramebuffers(1, &framebuffer);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);  // stays bound: the context has no other
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, colour);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return {};
  return fail(ErrorCode::kUnsupported, "the graphics driver has no framebuffer of " + std::to_string(width_px) + "x" +
                                           std::to_string(height_px) + " pixels");
}

OffscreenTarget::Use OffscreenTarget::use() const {
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_);
  return Use(*this);
}

OffscreenTarget::Use::~Use() {
  eglMakeCurrent(target_.display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
}

Result<> HeadlessProjectorOptions::validate() const {
  if (width_px < 1 || width_px > kSideMaxPx)
    return fail(ErrorCode::kInvalidArgument, "must be between 1 and 16384", "width_px");
  if (height_px < 1 || height_px > kSideMaxPx)
    return fail(ErrorCode::kInvalidArgument, "must be between 1 and 16384", "height_px");
  if (auto valid = light.validate(); !valid) return valid;
  if (!(refresh_hz >= 1.0 && refresh_hz <= 1000.0))
    return fail(ErrorCode::kInvalidArgument, "must be between 1 and 1000", "refresh_hz");
  return {};
}

HeadlessProjector::HeadlessProjector(HeadlessProjectorOptions options)
    : options_(std::move(options)), description_{"headless", "headless", options_.width_px, options_.height_px} {}

HeadlessProjector::~HeadlessProjector() = default;

Result<> HeadlessProjector::open(MonotonicTime) {
  if (auto valid = options_.validate(); !valid) return valid;
  if (!target_) {
    if (auto made = make_target(); !made) return made;
  }
  draw(Grey8(options_.width_px, options_.height_px));
  connected_ = true;
  complete_.reset();
  first_refresh_ = std::chrono::steady_clock::now();
  return {};
}

Result<> HeadlessProjector::make_target() {
  auto target = OffscreenTarget::create(options_.width_px, options_.height_px);
  if (!target) return tl::unexpected(target.error());
  const auto current = (*target)->use();
  auto painter = TexelPainter::create(options_.width_px, options_.height_px, LightCurve(options_.light));
  if (!painter) return tl::unexpected(painter.error());
  target_ = std::move(*target);
  painter_ = *painter;
  return {};
}

void HeadlessProjector::draw(const Grey8& image) {
  const auto current = target_->use();
  painter_->load(image);
  painter_->draw();
}

Result<MonotonicTime> HeadlessProjector::show(const Grey8& image, MonotonicTime deadline) {
  if (auto begun = begin(image); !begun) return tl::unexpected(begun.error());
  const MonotonicTime complete = *complete_;
  std::this_thread::sleep_until(std::min(complete, deadline));
  if (complete > deadline) return fail(ErrorCode::kTimeout, "it takes longer", description_.monitor);
  complete_.reset();
  return complete;
}

Result<> HeadlessProjector::begin(const Grey8& image) {
  const bool under_way = complete_ && image == showing_;
  if (!under_way) ++shows_;
  if (!under_way && std::ranges::find(options_.disconnect_at, shows_) != options_.disconnect_at.end()) disconnect();
  if (auto connected = check({}); !connected) return connected;
  if (under_way) return {};
  if (image.width() != options_.width_px || image.height() != options_.height_px)
    return fail(ErrorCode::kMismatch,
                "the image is " + size_text(image.width(), image.height()) + " pixels, the projector " +
                    size_text(options_.width_px, options_.height_px) + "; make the pattern for this projector",
                description_.monitor);
  draw(image);
  showing_ = image;
  complete_ = next_refresh(std::chrono::steady_clock::now()) + period();
  return {};
}

Result<Grey8> HeadlessProjector::read_back() {
  if (auto connected = check({}); !connected) return tl::unexpected(connected.error());
  const auto current = target_->use();
  return painter_->read();
}

Result<> HeadlessProjector::check(MonotonicTime) {
  if (connected_) return {};
  return fail(ErrorCode::kDisconnected, "the projector is not there; check its cable and open it again",
              description_.monitor);
}

std::chrono::nanoseconds HeadlessProjector::period() const {
  return std::chrono::nanoseconds(std::llround(1e9 / options_.refresh_hz));
}

MonotonicTime HeadlessProjector::next_refresh(MonotonicTime after) const {
  return first_refresh_ + ((after - first_refresh_) / period() + 1) * period();
}

}  // namespace slsd
