// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/x11/x_display.hpp"

#include <csetjmp>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <X11/Xlib.h>
#include <X11/Xlibint.h>
#include <X11/extensions/dpms.h>
#include <unistd.h>

#include "core/printable.hpp"

namespace slsd {
namespace {

int on_failed_request(Display*, XErrorEvent*) {
  return 0;
}

void note_loss(Display* display, void* lost);

thread_local std::jmp_buf* guarded = nullptr;  // the place to continue when a connection breaks

// Xlib ends the process after this, unless survive_loss() was called. GLFW calls Xlib before that is possible.
int on_lost_connection(Display* display) {
  if (guarded == nullptr || display->exit_handler == note_loss) return 0;
  ::close(ConnectionNumber(display));
  std::longjmp(*guarded, 1);
}

// For a broken connection, Xlib writes requests into a buffer that nobody empties, and crashes when it is full. After a
// write by Mesa it is full from the start.
void forget_requests(Display* display) {
  constexpr std::size_t kEnoughBytes = 1 << 20;
  auto* buffer = static_cast<char*>(std::malloc(kEnoughBytes));
  if (buffer == nullptr) return;
  std::free(display->buffer);
  display->buffer = display->bufptr = buffer;
  display->bufmax = buffer + kEnoughBytes;
}

void note_loss(Display* display, void* lost) {
  static_cast<std::atomic<bool>*>(lost)->store(true);
  forget_requests(display);
  if (guarded != nullptr) std::longjmp(*guarded, 1);
}

}  // namespace

void survive_x_errors() {
  XSetErrorHandler(on_failed_request);
  XSetIOErrorHandler(on_lost_connection);
}

void survive_loss(_XDisplay* display, std::atomic<bool>& lost) {
  XSetIOErrorExitHandler(display, note_loss, &lost);
}

bool survive_call(const std::function<void()>& call) {
  std::jmp_buf here;
  volatile bool survived = false;
  guarded = &here;
  if (setjmp(here) == 0) {
    call();
    survived = true;
  }
  guarded = nullptr;
  return survived;
}

tl::unexpected<Error> no_display() {
  const char* name = std::getenv("DISPLAY");
  if (name == nullptr || *name == '\0') {
    return fail(ErrorCode::kNotFound,
                "no display: DISPLAY is not set; start the projector's X server (slsd-display.service), or allow the "
                "service into your session (docs/projector.md)",
                "projector");
  }
  return fail(ErrorCode::kNotFound,
              "no display: cannot connect to the X server at DISPLAY=" + printable(name) +
                  "; start it, or allow the service's user in (xhost, XAUTHORITY)",
              "projector");
}

tl::unexpected<Error> no_answer() {
  const char* name = std::getenv("DISPLAY");
  return fail(ErrorCode::kIo,
              "the display server does not answer at DISPLAY=" + printable(name != nullptr ? name : "") +
                  "; the projector returns when it does, otherwise restart it (slsd-display.service)",
              "projector");
}

bool owns_display() {
  const char* folder = std::getenv("SLSD_OWN_DISPLAY");
  std::error_code ignored;
  return folder != nullptr && *folder != '\0' && std::filesystem::is_directory(folder, ignored);
}

std::unique_ptr<StayAwake> StayAwake::begin(_XDisplay* display) {
  int event = 0;
  int error = 0;
  CARD16 level = DPMSModeOn;
  BOOL enabled = False;
  if (DPMSQueryExtension(display, &event, &error) != 0 && DPMSCapable(display) != 0) {
    DPMSInfo(display, &level, &enabled);
  }
  if (enabled != 0) {
    if (level != DPMSModeOn) DPMSForceLevel(display, DPMSModeOn);
    DPMSDisable(display);
  }
  return std::unique_ptr<StayAwake>(new StayAwake(display, enabled != 0));
}

StayAwake::~StayAwake() {
  if (!was_enabled_) return;
  DPMSEnable(display_);
  XFlush(display_);
}

}  // namespace slsd
