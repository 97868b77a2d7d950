// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <variant>

#include "drivers/camera/file_camera.hpp"
#include "tests/drivers/plain_images.hpp"
#include "tests/drivers/temporary_folder.hpp"

namespace slsd::test {

/// A time that no capture in these tests should ever reach.
inline MonotonicTime far_away() {
  return std::chrono::steady_clock::now() + std::chrono::minutes(1);
}

/// A folder with frames of 12x8 pixels, the i-th of which begins with the value 10 * i.
inline void record(const TemporaryFolder& folder, int frames) {
  for (int i = 0; i < frames; ++i)
    folder.write("frame-" + std::to_string(i) + ".pgm", pnm_bytes(samples_of(ramp8(12, 8, 10 * i))));
}

/// Which frame of record() it is.
inline int number_of(const Frame& frame) {
  return std::get<ImageView<std::uint8_t>>(frame.image()).at(0, 0) / 10;
}

}  // namespace slsd::test
