// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "core/cloud/pcd.hpp"
#include "core/cloud/ply.hpp"

// Whatever is read can be written, and has a place on its lattice.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(bytes), size);
  const auto read = slsd::read_ply(text, "fuzz");
  if (!read) return 0;
  if (!slsd::read_ply(slsd::write_ply(*read), "again")) std::abort();
  const bool small = std::int64_t{read->lattice_columns} * read->lattice_rows * read->cameras < 100000;
  if (small && slsd::write_pcd(*read).empty()) std::abort();
  return 0;
}
