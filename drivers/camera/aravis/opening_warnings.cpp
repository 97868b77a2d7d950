// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/opening_warnings.hpp"

namespace slsd {
namespace {

constexpr int kJumboMtu = 9000;

}  // namespace

NetworkWarning device_clock_warning(std::string_view fault) {
  return {"device_clock", "the camera's clock " + std::string(fault) +
                              ": when frames were exposed is told by their arrival, a capture that is not triggered "
                              "waits some frames longer, and a frame that comes too late ends the session; set "
                              "device_clock = \"arrival\", and readout_us where it is known"};
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

NetworkWarning packet_size_warning(unsigned packet_bytes, const std::optional<HostInterface>& interface) {
  std::string advice = "packets have " + std::to_string(packet_bytes) + " bytes only";
  const int mtu_bytes = interface ? interface->mtu_bytes.value_or(0) : 0;
  if (mtu_bytes >= kJumboMtu)
    advice += ", and " + interface->name + " takes " + std::to_string(mtu_bytes) +
              ": let every switch and the camera pass 9000, or set packet_bytes if the camera cannot try sizes";
  else
    advice += "; set the MTU of " + (interface ? interface->name : "the interface") + ", and of every switch, to 9000";
  return {"packet_size", advice};
}

}  // namespace slsd
