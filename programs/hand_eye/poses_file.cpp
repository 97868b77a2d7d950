// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/hand_eye/poses_file.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "core/printable.hpp"

namespace slsd {
namespace {

constexpr std::string_view kSeparators = ",; \t\r[]";
constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";  // spreadsheets begin UTF-8 with it
constexpr std::size_t kShownBytes = 40;

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (std::size_t at = line.find_first_not_of(kSeparators); at != line.npos;
       at = line.find_first_not_of(kSeparators, at)) {
    const std::size_t end = std::min(line.find_first_of(kSeparators, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = end;
  }
  return words;
}

std::optional<double> number_of(std::string_view word) {
  double value = 0;
  if (word.starts_with('+')) word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

}  // namespace

Result<std::vector<PoseLine>> read_poses(std::string_view text, std::string_view name) {
  std::vector<PoseLine> poses;
  bool first = true;
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const auto words = words_of(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (words.empty() || words.front().starts_with('#')) continue;
    const auto wrong = [&, number](const std::string& what) {
      return fail(ErrorCode::kMalformed, what, fmt::format("{}:{}", name, number));
    };
    PoseLine pose{std::string(words.front()), {}};
    const bool heading =
        std::exchange(first, false) && words.size() > 1 &&
        std::none_of(words.begin() + 1, words.end(), [](auto word) { return number_of(word).has_value(); });
    if (heading) continue;
    for (const std::string_view word : std::span(words).subspan(1)) {
      const auto value = number_of(word);
      if (!value) return wrong(printable(word, kShownBytes) + " is not a number");
      pose.numbers.push_back(*value);
    }
    if (std::ranges::find(poses, pose.name, &PoseLine::name) != poses.end())
      return wrong(printable(pose.name, kShownBytes) + " is given twice");
    poses.push_back(std::move(pose));
  }
  if (poses.empty())
    return fail(ErrorCode::kMalformed, "has no pose: write a line for each capture, such as pose_00,x,y,z,...",
                std::string(name));
  return poses;
}

}  // namespace slsd
