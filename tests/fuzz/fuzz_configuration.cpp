// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "daemon/configuration/configuration.hpp"

// Any bytes are a configuration, or an error with its place.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const auto configuration = slsd::read_configuration({reinterpret_cast<const char*>(bytes), size}, "folder/slsd.toml");
  if (!configuration && configuration.error().where.empty()) __builtin_trap();
  return 0;
}
