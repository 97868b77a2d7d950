// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/file_tree.hpp"

#include <algorithm>
#include <charconv>
#include <limits>
#include <optional>

namespace slsd {
namespace {

using Kind = FileNode::Kind;

constexpr std::size_t kMaxKeys = 256;

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = std::min(text.find_first_not_of(' '), text.size());
  return text.substr(begin, text.find_last_not_of(" \r") + 1 - begin);
}

std::optional<double> number_in(std::string_view text) {
  const bool minus = text.starts_with('-');
  const std::string_view size = text.substr(minus || text.starts_with('+') ? 1 : 0);
  if (size == ".Nan" || size == ".NaN" || size == ".nan") return std::numeric_limits<double>::quiet_NaN();
  double value = std::numeric_limits<double>::infinity();
  if (size != ".Inf" && size != ".inf") {
    const char* const end = size.data() + size.size();
    if (size.empty() || size[0] == '-' || size[0] > '9') return std::nullopt;  // from_chars() knows "inf" and "nan"
    if (std::from_chars(size.data(), end, value).ptr != end) return std::nullopt;
  }
  return minus ? -value : value;
}

// One line that says something, without its comment.
struct Line {
  int number;
  std::size_t indent;
  std::string_view text;
};

std::string_view without_comment(std::string_view line) {
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (quoted && line[i] == '\\')
      ++i;
    else if (line[i] == '"')
      quoted = !quoted;
    else if (line[i] == '#' && !quoted)
      return line.substr(0, i);
  }
  return line;
}

std::vector<Line> lines_of(std::string_view text) {
  std::vector<Line> lines;
  bool begun = false;
  for (int number = 1; !text.empty(); ++number) {
    const std::string_view whole = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(whole.size() + 1, text.size()));
    const std::string_view line = without_comment(whole);
    const std::string_view words = trimmed(line);
    if (begun && !words.empty()) lines.push_back({number, line.find_first_not_of(' '), words});
    begun = begun || words.starts_with("---");
  }
  return lines;
}

// Goes from line to line; what is below a line stands further in.
class TreeReader {
 public:
  explicit TreeReader(std::vector<Line> lines) : lines_(std::move(lines)) {}

  tl::expected<FileNode, SyntaxProblem> read() {
    FileNode root;
    if (!lines_.empty()) root = block(lines_[0].indent);
    if (!ends() && !problem_) refuse("is indented too far, or too little");
    if (problem_) return tl::unexpected(*problem_);
    return root;
  }

 private:
  [[nodiscard]] bool ends() const { return problem_ || at_ == lines_.size(); }
  [[nodiscard]] Line& line() { return lines_[at_]; }
  [[nodiscard]] static bool is_item(const Line& line) { return line.text == "-" || line.text.starts_with("- "); }
  void refuse(const std::string& what) {
    if (!problem_) problem_ = SyntaxProblem{lines_[std::min(at_, lines_.size() - 1)].number, what};
  }

  // Recursive, but each level stands at least one further in, and syntax_problem() bounds that.
  FileNode block(std::size_t indent) {
    if (is_item(line())) return sequence(indent);
    if (line().text.starts_with('[')) return list(line().text);
    return map(indent);
  }

  FileNode sequence(std::size_t indent) {
    FileNode node{.kind = Kind::kSequence};
    while (!ends() && line().indent == indent && is_item(line())) {
      Line& item = line();
      const std::string_view rest = trimmed(item.text.substr(1));
      if (!rest.empty()) {  // its first key stands on the same line
        item.indent += static_cast<std::size_t>(rest.data() - item.text.data());
        item.text = rest;
        node.items.push_back(block(item.indent));
        continue;
      }
      ++at_;
      node.items.push_back(below(indent, false));
    }
    return node;
  }

  FileNode map(std::size_t indent) {
    FileNode node{.kind = Kind::kMap};
    while (!ends() && line().indent == indent && !is_item(line())) {
      const std::size_t colon = line().text.find(':');
      if (colon == line().text.npos) return refuse("is not a key with a value"), node;
      const std::string key(line().text.substr(0, colon));
      if (node.find(key) != nullptr) return refuse(key + " is there twice"), node;
      if (node.entries.size() == kMaxKeys) return refuse("there are too many keys"), node;
      node.entries.emplace_back(key, value(trimmed(line().text.substr(colon + 1)), indent));
    }
    return node;
  }

  // Whatever stands further in than the line before; the items of a key's sequence may stand as far in as the key.
  FileNode below(std::size_t indent, bool of_key) {
    if (ends() || line().indent < indent || (line().indent == indent && !(of_key && is_item(line())))) return {};
    return block(line().indent);
  }

  FileNode value(std::string_view text, std::size_t indent) {
    if (text.starts_with('[')) return list(text);
    ++at_;
    if (text.empty() || text == "!!opencv-matrix") return below(indent, true);
    if (text.starts_with('"')) return quoted(text);
    if (const auto number = number_in(text)) return {.kind = Kind::kNumber, .number = *number};
    return {.kind = Kind::kText, .text = std::string(text)};
  }

  static FileNode quoted(std::string_view text) {
    FileNode node{.kind = Kind::kText};
    for (std::size_t i = 1; i < text.size() && text[i] != '"'; ++i) {
      if (text[i] == '\\' && i + 1 < text.size()) ++i;
      node.text += text[i];
    }
    return node;
  }

  FileNode list(std::string_view text) {
    std::string all(text);
    bool open = all.find(']') == all.npos;
    while (++at_ < lines_.size() && open) {
      open = line().text.find(']') == std::string_view::npos;
      (all += ' ') += line().text;
    }
    FileNode node{.kind = Kind::kNumbers};
    std::string_view rest = std::string_view(all).substr(1, all.find(']') - 1);
    while (!trimmed(rest).empty()) {
      const std::size_t comma = std::min(rest.find(','), rest.size());
      node.numbers.push_back(
          number_in(trimmed(rest.substr(0, comma))).value_or(std::numeric_limits<double>::quiet_NaN()));
      rest.remove_prefix(std::min(comma + 1, rest.size()));
    }
    return node;
  }

  std::vector<Line> lines_;
  std::size_t at_ = 0;
  std::optional<SyntaxProblem> problem_;
};

}  // namespace

const FileNode* FileNode::find(std::string_view key) const {
  const auto entry = std::ranges::find(entries, key, [](const auto& each) { return std::string_view(each.first); });
  return entry == entries.end() || entry->second.kind == Kind::kEmpty ? nullptr : &entry->second;
}

tl::expected<FileNode, SyntaxProblem> read_file_tree(std::string_view text) {
  if (const auto problem = syntax_problem(text)) return tl::unexpected(*problem);
  return TreeReader(lines_of(text)).read();
}

}  // namespace slsd
