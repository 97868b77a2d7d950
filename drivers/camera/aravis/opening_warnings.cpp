// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/opening_warnings.hpp"

namespace slsd {

NetworkWarning device_clock_warning() {
  return {"device_clock",
          "the camera's clock cannot be read: exposures are taken to end when frames are there, and a frame that comes "
          "too late ends the session"};
}

NetworkWarning chunks_warning() {
  return {"chunks",
          "what the camera appends to its frames is not as it describes it: it is turned off, and a frame of another "
          "exposure or gain than configured is not noticed; chunks = false spares the attempts"};
}

NetworkWarning first_frame_warning() {
  return {"first_frame",
          "the camera exposes at a signal only, so that opening cannot prove that its frames arrive; the first scan "
          "does"};
}

}  // namespace slsd
