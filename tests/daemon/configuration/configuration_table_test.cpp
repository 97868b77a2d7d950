// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// The table of keys in docs/tables against the reader, and the files that it gives.
#include <cmath>
#include <fstream>
#include <iomanip>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <string>

#include <gmock/gmock.h>

#include "docs/tables/configuration_files.hpp"
#include "docs/tables/configuration_table.hpp"
#include "tests/daemon/configuration/read_text.hpp"

namespace slsd {
namespace {

using test::read;

std::string text_of_source(const std::string& name) {
  std::ifstream file(std::string(SLSD_SOURCE_DIR) + "/" + name);
  return {std::istreambuf_iterator<char>(file), {}};
}

struct PlacedKey {
  std::string table;
  ConfigurationKey key;
  std::string meaning;
};

/// Every key of every table. The keys of every camera stand with each driver.
std::vector<PlacedKey> keys_of_table() {
  std::vector<PlacedKey> keys;
  const auto add = [&](const std::string& name, const ConfigurationTable& table) {
    for (const ConfigurationEntry& entry : table.entries)
      for (const ConfigurationKey& key : entry.keys) keys.push_back({name, key, meaning_of(entry)});
  };
  ConfigurationTable every_camera;
  for (const ConfigurationTable& table : configuration_tables()) {
    if (table.name == "camera") {
      every_camera = table;
      continue;
    }
    add(table.name, table);
    if (table.name.starts_with("camera.")) add(table.name, every_camera);
  }
  return keys;
}

/// A configuration with that key, and with the others that the key needs.
std::string with_key(const PlacedKey& placed, const std::string& value) {
  static const std::map<std::string, std::string> kNeeds{{"camera.file", "path = 'frames'"},
                                                         {"camera.v4l2", "device = 'camera'"},
                                                         {"camera.aravis", "id = '192.0.2.10'"},
                                                         {"action_lead_us", "ptp = true"},
                                                         {"width_px", "height_px = 1200"},
                                                         {"height_px", "width_px = 1600"},
                                                         {"reopen_first_ms", "reopen_longest_ms = 600000"},
                                                         {"reopen_longest_ms", "reopen_first_ms = 1"}};
  std::map<std::string, std::string> lines;
  const auto add = [&](const std::string& line) { lines[line.substr(0, line.find(' '))] = line; };
  for (const std::string& needed : {placed.table, placed.key.name})
    if (kNeeds.contains(needed)) add(kNeeds.at(needed));
  std::string text = "[" + placed.table + "]\n";
  if (placed.table.starts_with("camera.")) {
    text = "[[camera]]\n";
    add("driver = '" + placed.table.substr(7) + "'");
  }
  add(placed.key.name + " = " + value);
  for (const auto& [name, line] : lines) text += line + "\n";
  return text;
}

std::string refusal(const PlacedKey& placed, const std::string& value) {
  const auto configuration = read(with_key(placed, value));
  return configuration ? "" : to_string(configuration.error());
}

/// The value beside the end of a range, a little or a whole number farther.
std::string beside(const PlacedKey& placed, const std::string& end, int direction) {
  if (placed.key.value.find('.') == std::string::npos) return std::to_string(std::stoll(end) + direction);
  const double value = std::stod(end);
  std::ostringstream text;
  text << std::fixed << std::setprecision(12) << value + direction * std::max(1e-9, std::abs(value) * 1e-3);
  return text.str();
}

TEST(ConfigurationTable, GivesTheShippedFile) {
  EXPECT_EQ(text_of_source("config/slsd.toml"), configuration_file()) << "write it anew: ./run tables";
}

TEST(ConfigurationTable, GivesTheManualPage) {
  EXPECT_EQ(text_of_source("man/slsd.toml.5"), configuration_page()) << "write it anew: ./run tables";
}

TEST(ConfigurationTable, HasTheKeysOfTheReader) {
  std::set<std::string> of_table;
  for (const PlacedKey& placed : keys_of_table()) of_table.insert(placed.table + "." + placed.key.name);
  const std::vector<std::string> known = known_keys();
  EXPECT_EQ(of_table, std::set<std::string>(known.begin(), known.end()));
}

TEST(ConfigurationTable, HasValuesThatTheReaderAccepts) {
  for (const PlacedKey& placed : keys_of_table()) {
    if (placed.key.name == "driver" && placed.table != "camera.file") continue;
    EXPECT_EQ(refusal(placed, placed.key.value), "") << with_key(placed, placed.key.value);
  }
}

TEST(ConfigurationTable, HasTheRangesOfTheReader) {
  for (const PlacedKey& placed : keys_of_table()) {
    if (placed.key.low.empty()) continue;
    SCOPED_TRACE(placed.table + "." + placed.key.name);
    EXPECT_EQ(refusal(placed, placed.key.low), "");
    EXPECT_EQ(refusal(placed, placed.key.high), "");
    EXPECT_NE(refusal(placed, beside(placed, placed.key.low, -1)), "");
    EXPECT_NE(refusal(placed, beside(placed, placed.key.high, 1)), "");
  }
}

TEST(ConfigurationTable, NamesEachWordThatTheReaderAccepts) {
  constexpr std::string_view kChoices = " must be one of ";
  for (const PlacedKey& placed : keys_of_table()) {
    const std::string refused = refusal(placed, "'?'");
    const std::size_t at = refused.find(placed.key.name + std::string(kChoices));
    if (at == std::string::npos) continue;
    std::string words = refused.substr(at + placed.key.name.size() + kChoices.size());
    std::ranges::replace(words, ',', ' ');
    std::istringstream each(words);
    for (std::string word; each >> word;) {
      if (word.starts_with("Bayer")) word.erase(word.find_last_not_of("0123456789") + 1);  // the bits are told apart
      EXPECT_THAT(placed.meaning, testing::HasSubstr(word)) << placed.table << "." << placed.key.name;
    }
  }
}

// Ranges stand where the meaning names the key.
TEST(ConfigurationTable, NamesNoKeyInBraces) {
  for (const PlacedKey& placed : keys_of_table()) EXPECT_THAT(placed.meaning, testing::Not(testing::HasSubstr("{")));
}

}  // namespace
}  // namespace slsd
