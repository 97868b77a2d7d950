// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "core/calibration_file/calibration_file.hpp"
#include "core/geometry/calibration.hpp"

// Whatever is read can be written and read again.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const auto read = slsd::read_calibration({reinterpret_cast<const char*>(bytes), size}, "fuzz");
  if (read && !slsd::read_calibration(slsd::write_calibration(*read), "again")) std::abort();
  return 0;
}
