// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "tests/doubles/gige/frames/sensor.hpp"
#include "tests/doubles/gige/gige_camera_options.hpp"
#include "tests/doubles/gige/gige_faults.hpp"
#include "tests/doubles/gige/register_file.hpp"
#include "tests/doubles/gige/stream_sender.hpp"
#include "tests/doubles/gige/tick_clock.hpp"

namespace slsd::test {

/// Makes what an exposure looks like on the wire, as the registers want it: pixels, time stamp, and chunks where they
/// are on.
/// @param faults  whose counts of frames are used up here
/// @param frame   is reused; all but how much of it is sent becomes new
void compose_frame(const Sensor::Exposure& exposure, const RegisterFile& registers, const TickClock& clock,
                   const GigeCameraOptions& options, GigeFaults& faults, WireFrame& frame);

}  // namespace slsd::test
