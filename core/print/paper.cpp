// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/print/paper.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <optional>

namespace slsd {
namespace {

struct NamedPaper {
  std::string_view name;
  double width_mm;
  double height_mm;
};
constexpr std::array kPapers{
    NamedPaper{"A0", 1189, 841}, NamedPaper{"A1", 841, 594}, NamedPaper{"A2", 594, 420},
    NamedPaper{"A3", 420, 297},  NamedPaper{"A4", 297, 210}, NamedPaper{"letter", 279.4, 215.9},
};
constexpr double kLeastSideMm = 50;
constexpr double kGreatestSideMm = 10000;

bool same(std::string_view a, std::string_view b) {
  const auto lower = [](unsigned char c) { return std::tolower(c); };
  return std::ranges::equal(a, b, {}, lower, lower);
}

std::optional<double> length(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  if (!whole || !(value >= kLeastSideMm && value <= kGreatestSideMm)) return std::nullopt;
  return value;
}

}  // namespace

Result<Paper> parse_paper(std::string_view text) {
  for (const NamedPaper& paper : kPapers) {
    if (same(text, paper.name)) return Paper{std::string(paper.name), paper.width_mm, paper.height_mm};
  }
  const auto middle = text.find('x');
  const auto width = length(text.substr(0, middle));
  const auto height = middle == text.npos ? std::nullopt : length(text.substr(middle + 1));
  if (width && height) return Paper{std::string(text) + " mm", *width, *height};
  return fail(ErrorCode::kInvalidArgument, "unknown paper \"" + std::string(text) +
                                               "\"; give A0, A1, A2, A3, A4, letter or WIDTHxHEIGHT, each of 50 to "
                                               "10000 mm");
}

}  // namespace slsd
