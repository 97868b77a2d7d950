// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "tests/doubles/gige/frames/counter_frame.hpp"

namespace slsd::test {

/// What is wrong with the clock that can be read; frames are stamped by a good one.
enum class ClockFault {
  kNone,
  kStandsStill,
  kOtherEpoch,  ///< it began at another time than the one that stamps
  kOtherRate,   ///< it ticks twice as often as it says
  kGoesBack,    ///< whenever it is read
};

struct GigeCameraOptions {
  std::string serial = "DOUBLE-1";  ///< at most 15 letters; the vendor is "Aravis"
  std::string address = {};         ///< of this host; empty: one of 127.0.0.0/8 that is free
  int width_px = 64;
  int height_px = 48;
  ExposureSource frames = counter_frames();
  std::uint16_t first_frame_id = 65530;  ///< near its end, where many a receiver is wrong
  std::uint64_t tick_frequency_hz = 125'000'000;
  double drift_ppm = 40.0;  ///< how much faster than the host's the device's clock goes
  ClockFault clock_fault = ClockFault::kNone;
  bool restarts_ids = false;  ///< the first frame after each AcquisitionStart has the number 1
  /// How long after its exposure's end a frame is sent; without it a frame is sent as soon as its exposure begins.
  std::optional<std::chrono::microseconds> readout = {};
  std::chrono::microseconds arming{0};    ///< so long after AcquisitionStart it hears no trigger
  std::uint32_t packet_bytes_max = 9000;  ///< larger test packets get lost, as by a switch without jumbo frames
  bool breaks_up = false;                 ///< packets that the network does not take whole are sent in fragments
  bool chunks = true;                     ///< it has a chunk mode
  bool chunks_in_ns = false;              ///< the chunks' time stamp is in nanoseconds, and not in ticks
  std::uint32_t chunk_payload = 0x4001;   ///< how a frame with chunks is called
  bool software_trigger = true;           ///< it can be triggered by a command
  std::uint32_t ptp_status = 9;           ///< 8: uncalibrated, 9: slave, 0: it does not tell
  /// By how much the time stamp that a frame begins with is later than its exposure's start, as of the readout.
  std::chrono::milliseconds stamp_delay{0};
};

}  // namespace slsd::test
