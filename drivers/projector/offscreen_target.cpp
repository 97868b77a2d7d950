// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/offscreen_target.hpp"

#include <string>

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GLES3/gl3.h>

namespace slsd {
namespace {

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

}  // namespace slsd
