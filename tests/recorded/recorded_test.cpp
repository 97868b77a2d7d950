// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <ostream>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "tests/recorded/recorded.hpp"

namespace slsd {

void PrintTo(const FrameGroup& group, std::ostream* out) {
  *out << group.name();
}

namespace {

/// The lines of decoded.txt that are of a group.
std::vector<std::string> recorded(const FrameGroup& group) {
  std::ifstream file(std::filesystem::path(SLSD_SOURCE_DIR) / "tests/recorded/decoded.txt");
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);)
    if (line.substr(0, line.find_first_of(" :")) == group.name()) lines.push_back(line);
  return lines;
}

/// Whether a word of a line is the other line's. A fraction may differ by one in its last digit: the mean is rounded
/// there, and what a library's functions are rounded to depends on the processor.
bool is_same(const std::string& word, const std::string& other) {
  const std::size_t point = word.find('.');
  if (point == std::string::npos || other.find('.') == std::string::npos) return word == other;
  const auto decimals = static_cast<double>(word.size() - point - 1);
  return std::abs(std::stod(word) - std::stod(other)) < 1.5 * std::pow(10, -decimals);
}

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream words(line);
  return {std::istream_iterator<std::string>(words), {}};
}

MATCHER_P(IsSameAs, other, "is " + other) {
  const auto words = words_of(arg), others = words_of(other);
  return std::ranges::equal(words, others, is_same);
}

std::string name_of(const testing::TestParamInfo<FrameGroup>& info) {
  return "Of_" + info.param.name();
}

class Recorded : public testing::TestWithParam<FrameGroup> {};

// What the decoder makes of a frame is what it made of it when that was last looked at. Where it is meant to be
// another, ./run tables writes decoded.txt anew, and what has changed in it belongs to the change.
TEST_P(Recorded, IsDecodedAsItWas) {
  const auto lines = record(GetParam());
  ASSERT_TRUE(lines) << to_string(lines.error());
  std::vector<testing::Matcher<std::string>> as_recorded;
  for (const std::string& line : recorded(GetParam())) as_recorded.emplace_back(IsSameAs(line));
  EXPECT_THAT(*lines, testing::ElementsAreArray(as_recorded));
}

INSTANTIATE_TEST_SUITE_P(Frames, Recorded, testing::ValuesIn(recorded_groups()), name_of);

}  // namespace
}  // namespace slsd
