// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/x11/stay_awake.hpp"

#include <X11/Xlib.h>
#include <X11/extensions/dpms.h>

namespace slsd {

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
