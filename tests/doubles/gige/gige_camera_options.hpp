// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "tests/doubles/gige/counter_frame.hpp"

namespace slsd::test {

struct GigeCameraOptions {
  std::string serial = "DOUBLE-1";  ///< at most 15 letters; the vendor is "Aravis"
  std::string address = {};         ///< of this host; empty: one of 127.0.0.0/8 that is free
  int width_px = 64;
  int height_px = 48;
  ExposureSource frames = counter_frames();
  std::uint16_t first_frame_id = 65530;  ///< near its end, where many a receiver is wrong
  std::uint64_t tick_frequency_hz = 125'000'000;
  double drift_ppm = 40.0;                ///< how much faster than the host's the device's clock goes
  std::uint32_t packet_bytes_max = 9000;  ///< larger test packets get lost, as by a switch without jumbo frames
  bool chunks = true;                     ///< it has a chunk mode
  bool chunks_in_ns = false;              ///< the chunks' time stamp is in nanoseconds, and not in ticks
  std::uint32_t chunk_payload = 0x4001;   ///< how a frame with chunks is called
  bool software_trigger = true;           ///< it can be triggered by a command
  std::uint32_t ptp_status = 9;           ///< 8: uncalibrated, 9: slave, 0: it does not tell
  /// By how much the time stamp that a frame begins with is later than its exposure's start, as of the readout.
  std::chrono::milliseconds stamp_delay{0};
};

}  // namespace slsd::test
