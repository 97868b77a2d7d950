// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/listing/sysfs.hpp"

#include <algorithm>
#include <charconv>
#include <fstream>

namespace slsd {

using std::filesystem::path;

std::string first_line(const path& file) {
  std::string line;
  std::ifstream stream(file);
  std::getline(stream, line);
  return line;
}

std::optional<int> first_number(const path& file) {
  const std::string line = first_line(file);
  int number = 0;
  if (std::from_chars(line.data(), line.data() + line.size(), number).ec != std::errc()) return std::nullopt;
  return number;
}

std::vector<path> entries_of(const path& folder) {
  std::error_code error;
  std::vector<path> entries;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    entries.push_back(entry->path());
  std::ranges::sort(entries);
  return entries;
}

}  // namespace slsd
