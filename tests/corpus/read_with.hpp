// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <string_view>

#include "core/result.hpp"
#include "drivers/files/file.hpp"

namespace slsd {

/// Reads a text file and makes something of it with one of the readers, such as read_pattern() or read_calibration().
/// @errors of both
template <class Reader>
auto read_with(Reader reader, const std::filesystem::path& path)
    -> decltype(reader(std::string_view(), path.native())) {
  const auto text = read_file(path, 1 << 24);
  if (!text) return tl::unexpected(text.error());
  return reader(*text, path.native());
}

}  // namespace slsd
