// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "daemon/bundle/bundle.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view archive(reinterpret_cast<const char*>(bytes), size);
  const auto bundle = slsd::read_bundle(archive);
  if (!bundle && bundle.error().message.empty()) std::abort();
  if (!bundle) return 0;
  // Whatever is unpacked stays below its folder, and is a part of the archive.
  for (const slsd::TarFile& file : bundle->files) {
    if (!slsd::plain_tar_name(file.name)) std::abort();
    if (file.bytes.data() < archive.data() || file.bytes.data() + file.bytes.size() > archive.data() + size)
      std::abort();
  }
  return 0;
}
