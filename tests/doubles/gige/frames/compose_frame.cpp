// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/gige/frames/compose_frame.hpp"

#include <cstdint>

#include "tests/doubles/gige/frames/chunk_trailer.hpp"
#include "tests/doubles/gige/frames/pack_pixels.hpp"

namespace slsd::test {
namespace {

constexpr std::uint32_t kImagePayload = 1;

/// Whether one of a count is due, which it then was.
bool due(int& count) {
  return count > 0 && count-- > 0;
}

void add_chunks(const Sensor::Exposure& exposure, const RegisterFile& registers, const TickClock& clock,
                const GigeCameraOptions& options, GigeFaults& faults, WireFrame& frame) {
  frame.payload_type = sends_chunks(registers) ? options.chunk_payload : kImagePayload;
  if (frame.payload_type == kImagePayload) return;
  ChunkValues values{clock.ticks_at(exposure.begin), registers.read_double(kExposureTime),
                     registers.read_double(kGain)};
  if (options.chunks_in_ns) values.timestamp = clock.in_ns(values.timestamp);
  if (due(faults.misexposed_frames)) values.exposure_us *= 2.0;
  if (due(faults.misgained_frames)) values.gain_db += 1.0;
  ChunkFault fault = ChunkFault::kNone;
  if (due(faults.short_chunk_frames)) fault = ChunkFault::kShort;
  if (due(faults.garbage_chunk_frames)) fault = ChunkFault::kGarbage;
  append_chunks(registers, values, fault, frame.pixels);
}

}  // namespace

void compose_frame(const Sensor::Exposure& exposure, const RegisterFile& registers, const TickClock& clock,
                   const GigeCameraOptions& options, GigeFaults& faults, WireFrame& frame) {
  frame.id = exposure.id;
  frame.ticks = clock.ticks_at(exposure.begin + options.stamp_delay);
  frame.pixel_format = registers.read(kPixelFormat);
  frame.width_px = registers.read(kWidth);
  frame.height_px = registers.read(kHeight);
  options.frames({static_cast<int>(frame.width_px), static_cast<int>(frame.height_px), used_bits(frame.pixel_format),
                  exposure.counter},
                 frame.pixels);
  pack_pixels(frame.pixel_format, frame.pixels);
  add_chunks(exposure, registers, clock, options, faults, frame);
  if (due(faults.truncate_frames)) frame.sent_share = 0.5;
}

}  // namespace slsd::test
