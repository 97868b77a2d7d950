// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/file_syntax.hpp"

#include <algorithm>

namespace slsd {
namespace {

constexpr std::size_t kMaxLineLength = 1024;
constexpr std::size_t kMaxIndent = 64;
constexpr int kMaxBrackets = 4;

bool is_text(char letter) {
  const auto byte = static_cast<unsigned char>(letter);
  return (byte >= 0x20 && byte != 0x7f) || letter == '\r';
}

// Depth of open brackets and braces after the line; quoted ones count too, which no calibration file needs.
int depth_after(std::string_view line, int depth) {
  for (const char letter : line) {
    if (letter == '[' || letter == '{') ++depth;
    if (letter == ']' || letter == '}') --depth;
    if (depth > kMaxBrackets) return depth;
  }
  return depth;
}

std::optional<std::string> line_problem(std::string_view line) {
  if (line.size() > kMaxLineLength) return "is no calibration file: a line above 1024 bytes";
  if (!std::all_of(line.begin(), line.end(), is_text)) return "is no calibration file: a byte that is not text";
  const std::size_t start = std::min(line.find_first_not_of(' '), line.size());
  if (start > kMaxIndent) return "is no calibration file: indented by more than 64 spaces";
  if (line.substr(start, 1) == "-" && line.substr(0, 3) != "---") {
    const std::size_t next = line.find_first_not_of(' ', start + 1);
    if (next != line.npos && line[next] == '-') return "is no calibration file: a sequence right in a sequence";
  }
  if (line.find("$base64$") != line.npos) return "has base64 data, which is not read; write plain numbers";
  return std::nullopt;
}

}  // namespace

std::optional<SyntaxProblem> syntax_problem(std::string_view text) {
  if (text.substr(0, 5) != "%YAML") return SyntaxProblem{1, "is no calibration file: it has to begin with %YAML:1.0"};
  int number = 0, depth = 0;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    ++number;
    if (auto problem = line_problem(line)) return SyntaxProblem{number, std::move(*problem)};
    depth = depth_after(line, depth);
    if (depth > kMaxBrackets || depth < 0) return SyntaxProblem{number, "has brackets that do not pair"};
  }
  return std::nullopt;
}

}  // namespace slsd
