// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <fstream>
#include <iostream>
#include <string>

#include "docs/tables/alphabet_picture.hpp"
#include "docs/tables/alphabet_tables.hpp"
#include "docs/tables/array_tables.hpp"
#include "docs/tables/profile_chart.hpp"
#include "docs/tables/reason_table.hpp"
#include "docs/tables/shipped_patterns.hpp"

namespace {

bool write(const std::string& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  return static_cast<bool>(stream.flush());
}

bool write_patterns(const std::string& folder) {
  for (const slsd::ShippedPattern& shipped : slsd::shipped_patterns()) {
    const auto pattern = slsd::make_pattern(shipped.options);
    if (!pattern) std::cerr << shipped.name << ": " << to_string(pattern.error()) << "\n";
    if (!pattern || !write(folder + "/" + shipped.name + ".toml", slsd::write_pattern(*pattern))) return false;
  }
  return true;
}

bool write_documents(const std::string& folder) {
  const auto profiles = slsd::profiles_to_show();
  return slsd::write_alphabet_picture(folder + "/alphabet.png") &&
         slsd::write_profile_chart(profiles, folder + "/profiles.png") &&
         write(folder + "/arrays.md", slsd::array_document(profiles)) &&
         write(folder + "/alphabet.md", slsd::alphabet_document()) &&
         write(folder + "/reasons.md", slsd::reason_document());
}

}  // namespace

// Writes the generated tables and pictures of docs/ anew, and the shipped patterns where their folder is named.
int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::cerr << "usage: slsd-tables DOCS_FOLDER [PATTERNS_FOLDER]\n";
    return 2;
  }
  const bool written = write_documents(argv[1]) && (argc < 3 || write_patterns(argv[2]));
  if (!written) std::cerr << "slsd-tables: cannot write into " << argv[1] << "\n";
  return written ? 0 : 1;
}
