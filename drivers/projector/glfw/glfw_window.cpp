// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/glfw/glfw_window.hpp"

#include <chrono>
#include <string>
#include <thread>

#define GLFW_INCLUDE_NONE
#define GLFW_EXPOSE_NATIVE_X11
#include <GLFW/glfw3.h>
#include <GLFW/glfw3native.h>

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr auto kManagersTimeout = 5s;  // a window manager may be busy

std::atomic_flag in_use;  // a process has only one GLFW

GLFWmonitor* find_monitor(unsigned long output) {
  int count = 0;
  GLFWmonitor** monitors = glfwGetMonitors(&count);
  for (int i = 0; i < count; ++i) {
    if (glfwGetX11Monitor(monitors[i]) == output) return monitors[i];
  }
  return nullptr;
}

void set_hints(int refresh_hz) {
  glfwDefaultWindowHints();
  glfwWindowHint(GLFW_CLIENT_API, GLFW_OPENGL_ES_API);
  glfwWindowHint(GLFW_CONTEXT_CREATION_API, GLFW_EGL_CONTEXT_API);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 0);
  glfwWindowHint(GLFW_DEPTH_BITS, 0);
  glfwWindowHint(GLFW_STENCIL_BITS, 0);
  glfwWindowHint(GLFW_ALPHA_BITS, 0);  // a compositor would make non-opaque pixels transparent
  glfwWindowHint(GLFW_RESIZABLE, GLFW_FALSE);
  glfwWindowHint(GLFW_DECORATED, GLFW_FALSE);
  glfwWindowHint(GLFW_FOCUSED, GLFW_FALSE);
  glfwWindowHint(GLFW_AUTO_ICONIFY, GLFW_FALSE);
  glfwWindowHint(GLFW_CENTER_CURSOR, GLFW_FALSE);
  glfwWindowHint(GLFW_REFRESH_RATE, refresh_hz);
  glfwWindowHintString(GLFW_X11_CLASS_NAME, "slsd");
  glfwWindowHintString(GLFW_X11_INSTANCE_NAME, "slsd");
}

// Keeps the current mode if it fits; else takes the monitor's fastest of that size.
int refresh_to_ask_for(GLFWmonitor* monitor, int width_px, int height_px) {
  const GLFWvidmode* mode = glfwGetVideoMode(monitor);
  return mode != nullptr && mode->width == width_px && mode->height == height_px ? mode->refreshRate : GLFW_DONT_CARE;
}

std::string last_error() {
  const char* description = nullptr;
  glfwGetError(&description);
  return description != nullptr ? description : "no reason given";
}

}  // namespace

Result<std::unique_ptr<GlfwSession>> GlfwSession::open() {
  if (in_use.test_and_set()) return fail(ErrorCode::kBusy, "this process already has a GLFW projector", "projector");
  survive_x_errors();
  int begun = GLFW_FALSE;
  if (!survive_call([&begun] { begun = glfwInit(); }) || begun != GLFW_TRUE) {
    in_use.clear();
    return no_display();
  }
  std::unique_ptr<GlfwSession> session(new GlfwSession);
  session->display_ = glfwGetX11Display();
  survive_x_errors();
  survive_loss(session->display_, session->lost_);
  session->awake_ = StayAwake::begin(session->display_);
  return session;
}

GlfwSession::~GlfwSession() {
  awake_.reset();
  glfwTerminate();
  in_use.clear();
}

int GlfwSession::descriptor() const {
  return ConnectionNumber(display_);
}

void GlfwSession::handle_events() {
  if (!lost_) static_cast<void>(survive_call(glfwPollEvents));
}

Result<std::unique_ptr<FullscreenWindow>> FullscreenWindow::open(GlfwSession& session, const RandrOutput& output,
                                                                 int width_px, int height_px) {
  const std::string where = "monitor " + output.name;
  GLFWmonitor* monitor = find_monitor(output.id);
  if (monitor == nullptr) return fail(ErrorCode::kNotFound, "it was disconnected while it was opening", where);
  set_hints(refresh_to_ask_for(monitor, width_px, height_px));
  std::unique_ptr<FullscreenWindow> window(new FullscreenWindow(session));
  GLFWwindow* created = nullptr;
  const auto create = [&] { created = glfwCreateWindow(width_px, height_px, "slsd projector", monitor, nullptr); };
  const bool survived = survive_call(create);
  survive_x_errors();
  if (!survived) return fail(ErrorCode::kDisconnected, "the X server ended while it was opening", where);
  window->window_ = created;
  if (window->window_ == nullptr) {
    return fail(ErrorCode::kUnsupported, "cannot draw on it: " + last_error() + "; install libgl1-mesa-dri and libegl1",
                where);
  }
  glfwMakeContextCurrent(window->window_);
  glfwSwapInterval(1);
  glfwSetInputMode(window->window_, GLFW_CURSOR, GLFW_CURSOR_HIDDEN);
  glfwSetWindowUserPointer(window->window_, window.get());
  glfwSetWindowRefreshCallback(window->window_, [](GLFWwindow* damaged) {
    static_cast<FullscreenWindow*>(glfwGetWindowUserPointer(damaged))->damaged_ = true;
  });
  if (window->wait_until_it_covers(output.id, width_px, height_px)) return window;
  return fail(ErrorCode::kMismatch,
              "the window does not cover all of its pixels: set it to the size in [projector], and let no window "
              "manager reserve a part of it",
              where);
}

FullscreenWindow::~FullscreenWindow() {
  if (window_ != nullptr) glfwDestroyWindow(window_);
}

std::uint32_t FullscreenWindow::id() const {
  return static_cast<std::uint32_t>(glfwGetX11Window(window_));
}

bool FullscreenWindow::covers(const DesktopArea& area) const {
  DesktopArea mine;
  glfwGetWindowPos(window_, &mine.x_px, &mine.y_px);
  glfwGetFramebufferSize(window_, &mine.width_px, &mine.height_px);
  return mine == area && glfwGetWindowAttrib(window_, GLFW_VISIBLE) == GLFW_TRUE;
}

bool FullscreenWindow::wait_until_it_covers(unsigned long output, int width_px, int height_px) {
  const auto deadline = steady_clock::now() + kManagersTimeout;
  while (steady_clock::now() < deadline && !session_.lost()) {
    session_.handle_events();
    const auto area = lit_area(session_.display(), output);
    if (!area) return false;  // turned off meanwhile, so nothing to wait for
    if (area->width_px == width_px && area->height_px == height_px && covers(*area)) return true;
    std::this_thread::sleep_for(5ms);
  }
  return false;
}

void FullscreenWindow::swap() {
  glfwSwapBuffers(window_);
  XSync(session_.display(), False);
}

}  // namespace slsd
