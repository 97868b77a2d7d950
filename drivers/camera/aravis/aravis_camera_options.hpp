// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "core/result.hpp"
#include "drivers/camera/aravis/gvcp.hpp"

namespace slsd {

/// The trigger of the camera's exposures.
enum class AravisTrigger {
  kSoftware,  ///< a command at each capture()
  kLine,      ///< a rising edge on an input line
  kFreeRun,   ///< the camera's own clock
  kAction,    ///< GigE: one command to all cameras with the same keys
};

/// The clock that tells when an exposure began.
enum class AravisClock {
  kAuto,     ///< the device's clock; the arrival of frames if the clock cannot be read or trusted
  kDevice,   ///< the device's clock whenever it can be read
  kArrival,  ///< the arrival of frames
};

/// The keys of a [[camera]] table whose driver is "aravis".
struct AravisCameraOptions {
  static constexpr std::string_view kDriver = "aravis";
  std::string name = "camera";
  std::string id = {};         ///< serial number, "vendor-serial", or IPv4 address; an address is found fastest
  std::string interface = {};  ///< IPv4 address of this host's interface; empty: the route's
  AravisTrigger trigger = AravisTrigger::kSoftware;
  std::string trigger_line = "Line1";  ///< the input line, if the trigger is a line
  ActionKeys action = {};              ///< GigE, for an action trigger: the same for all cameras of a group
  double action_lead_us = 0.0;         ///< GigE: all expose so long after the command; 0, or no common clock: at once
  bool ptp = false;                    ///< the camera's clock follows the network's (IEEE 1588)
  double rate_hz = 0.0;                ///< in free run, up to 10000; 0: the camera's own
  AravisClock device_clock = AravisClock::kAuto;
  double readout_us = 0.0;       ///< used for frames timed by arrival, without a command: the longest time from an
                                 ///< exposure's end to the frame's arrival, up to 10000000; 0: two periods
  double exposure_us = 10000.0;  ///< 1 to 10000000
  double gain_db = 0.0;          ///< 0 to 60
  std::string pixel_format = "Mono8";               ///< Mono8, Mono10, Mono12, Mono16, packed, or Bayer in 8 to 16 bits
  std::optional<std::pair<int, int>> size_px = {};  ///< centred on the sensor; empty: the whole sensor
  bool chunks = true;            ///< if available: compare each frame's own exposure and gain with these
  int packet_bytes = 0;          ///< GigE: with headers, 576 to 16000; 0: the largest that arrives
  double packet_delay_us = 0.0;  ///< GigE: between two packets, if several cameras share a link
  int receive_buffer_bytes = 0;  ///< GigE: of the socket; 0: two frames. net.core.rmem_max must allow it
  bool packet_resend = true;     ///< GigE: request lost packets again
  bool packet_socket = true;     ///< GigE: take packets before the UDP socket, if CAP_NET_RAW allows it
  int frame_timeout_ms = 1000;   ///< longest time from the trigger, or from the frame before, to a frame: 10 to 60000
  int missed_frames_max = 2;     ///< the camera is gone after this many missing frames in a row
  int frames_held_max = 8;       ///< number of frames that may be held at once, 2 to 64

  /// Tells whether `id` is an address.
  [[nodiscard]] bool names_address() const;
  /// @errors kInvalidArgument: the message begins with the key
  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const AravisCameraOptions&, const AravisCameraOptions&) = default;
};

[[nodiscard]] std::chrono::nanoseconds from_us(double duration_us);

/// The longest time from the request to the arrival of a frame.
/// @thread reentrant
[[nodiscard]] std::chrono::nanoseconds frame_timeout(const AravisCameraOptions& options);

/// The number of streams that are tried until one gives a frame.
inline constexpr int kFirstFrameTries = 3;

/// The wait for a stream's first frame before a new stream is tried. Most cameras need less.
/// @param trigger       kFreeRun or kSoftware, depending on how frames are verified
/// @param tries_before  0 to kFirstFrameTries - 1
/// @thread reentrant
[[nodiscard]] std::chrono::nanoseconds first_frame_timeout(const AravisCameraOptions& options, AravisTrigger trigger,
                                                           int tries_before);

/// The longest time for all these tries, with chunks and again without.
/// @thread reentrant
[[nodiscard]] std::chrono::nanoseconds first_frame_time_max(const AravisCameraOptions& options);

/// The greatest age of an exposure at which the next frame is still current, for a camera in free run: a few periods.
/// @thread reentrant
[[nodiscard]] std::chrono::nanoseconds next_frame_age_max(const AravisCameraOptions& options);

}  // namespace slsd
