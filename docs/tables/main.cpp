// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <fstream>
#include <iostream>
#include <string>

#include "docs/tables/alphabet_picture.hpp"
#include "docs/tables/alphabet_tables.hpp"
#include "docs/tables/array_tables.hpp"
#include "docs/tables/configuration_files.hpp"
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

// Writes the generated tables and pictures of docs/ anew, the shipped patterns, the configuration and its page.
int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: slsd-tables FOLDER_OF_THE_SOURCES\n";
    return 2;
  }
  const std::string sources = argv[1];
  const bool written = write(sources + "/config/slsd.toml", slsd::configuration_file()) &&
                       write(sources + "/man/slsd.toml.5", slsd::configuration_page()) &&
                       write_patterns(sources + "/config/patterns") && write_documents(sources + "/docs");
  if (!written) std::cerr << "slsd-tables: cannot write into " << sources << "\n";
  return written ? 0 : 1;
}
