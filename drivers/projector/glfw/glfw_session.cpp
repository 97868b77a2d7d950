// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/glfw/glfw_session.hpp"

#define GLFW_INCLUDE_NONE
#define GLFW_EXPOSE_NATIVE_X11
#include <GLFW/glfw3.h>
#include <GLFW/glfw3native.h>

#include "drivers/projector/x11/x_errors.hpp"

namespace slsd {
namespace {

std::atomic_flag in_use;

}  // namespace

Result<std::unique_ptr<GlfwSession>> GlfwSession::open() {
  if (in_use.test_and_set()) return fail(ErrorCode::kBusy, "the process has a GLFW projector already", "projector");
  survive_x_errors();
  if (glfwInit() != GLFW_TRUE) {
    in_use.clear();
    return no_display();
  }
  std::unique_ptr<GlfwSession> session(new GlfwSession);
  session->display_ = glfwGetX11Display();
  survive_x_errors();
  survive_loss(session->display_, session->lost_);
  return session;
}

GlfwSession::~GlfwSession() {
  glfwTerminate();
  in_use.clear();
}

int GlfwSession::descriptor() const {
  return ConnectionNumber(display_);
}

void GlfwSession::handle_events() {
  if (!lost_) glfwPollEvents();
}

}  // namespace slsd
