// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/gige/frames/chunk_trailer.hpp"

#include <bit>
#include <cstddef>
#include <random>

namespace slsd::test {
namespace {

// As camera.xml numbers them.
constexpr std::uint32_t kImageChunk = 1;
constexpr std::uint32_t kTimestampChunk = 0xa0000001;
constexpr std::uint32_t kExposureTimeChunk = 0xa0000002;
constexpr std::uint32_t kGainChunk = 0xa0000003;
constexpr std::size_t kMissingBytes = 6;

void put(std::vector<std::uint8_t>& frame, std::uint64_t value, int bytes) {
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) frame.push_back(static_cast<std::uint8_t>(value >> shift));
}

void end_chunk(std::vector<std::uint8_t>& frame, std::uint32_t id, std::size_t bytes) {
  put(frame, id, 4);
  put(frame, bytes, 4);
}

void append(std::vector<std::uint8_t>& frame, std::uint32_t id, std::uint64_t value) {
  put(frame, value, 8);
  end_chunk(frame, id, 8);
}

}  // namespace

bool sends_chunks(const RegisterFile& registers) {
  return registers.read(kChunkMode) != 0;
}

void append_chunks(const RegisterFile& registers, const ChunkValues& values, ChunkFault fault,
                   std::vector<std::uint8_t>& frame) {
  const std::size_t image_bytes = frame.size();
  end_chunk(frame, kImageChunk, image_bytes);
  if (registers.read(kChunkTimestampEnable) != 0) append(frame, kTimestampChunk, values.timestamp);
  if (registers.read(kChunkExposureTimeEnable) != 0)
    append(frame, kExposureTimeChunk, std::bit_cast<std::uint64_t>(values.exposure_us));
  if (registers.read(kChunkGainEnable) != 0) append(frame, kGainChunk, std::bit_cast<std::uint64_t>(values.gain_db));
  if (fault == ChunkFault::kShort) frame.resize(frame.size() - kMissingBytes);
  if (fault != ChunkFault::kGarbage) return;
  std::mt19937 random(7);
  for (std::size_t i = image_bytes; i < frame.size(); ++i) frame[i] = static_cast<std::uint8_t>(random());
}

}  // namespace slsd::test
