// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <vector>

#include "tests/doubles/gige/register_file.hpp"

namespace slsd::test {

/// What the chunks of one frame say.
struct ChunkValues {
  std::uint64_t timestamp = 0;
  double exposure_us = 0.0;
  double gain_db = 0.0;
};

/// What is wrong with the chunks of one frame.
enum class ChunkFault {
  kNone,
  kShort,    ///< the last bytes are missing
  kGarbage,  ///< all that is behind the image is noise
};

/// Whether chunk mode is on.
[[nodiscard]] bool sends_chunks(const RegisterFile& registers);

/// Puts the chunks that are on behind an image, by which it becomes a chunk itself.
void append_chunks(const RegisterFile& registers, const ChunkValues& values, ChunkFault fault,
                   std::vector<std::uint8_t>& frame);

}  // namespace slsd::test
