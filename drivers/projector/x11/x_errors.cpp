// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/x11/x_errors.hpp"

#include <cstdlib>
#include <string>

#include <X11/Xlib.h>

namespace slsd {
namespace {

int on_failed_request(Display*, XErrorEvent*) {
  return 0;
}

int on_lost_connection(Display*) {
  return 0;
}

void note_loss(Display*, void* lost) {
  static_cast<std::atomic<bool>*>(lost)->store(true);
}

}  // namespace

void survive_x_errors() {
  XSetErrorHandler(on_failed_request);
  XSetIOErrorHandler(on_lost_connection);
}

void survive_loss(_XDisplay* display, std::atomic<bool>& lost) {
  XSetIOErrorExitHandler(display, note_loss, &lost);
}

tl::unexpected<Error> no_display() {
  const char* name = std::getenv("DISPLAY");
  if (name == nullptr || *name == '\0') {
    return fail(ErrorCode::kNotFound,
                "no display: DISPLAY is not set; start the projector's X server (slsd-display.service), or let the "
                "service into your session, as docs/projector.md says",
                "projector");
  }
  return fail(ErrorCode::kNotFound,
              "no display: no X server lets us in at DISPLAY=" + std::string(name) +
                  "; start it, or give the service's user the right (xhost, XAUTHORITY)",
              "projector");
}

}  // namespace slsd
