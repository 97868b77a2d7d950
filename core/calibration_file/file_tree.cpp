// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibration_file/file_tree.hpp"

#include <yaml.h>

#include <algorithm>
#include <charconv>
#include <limits>
#include <map>
#include <memory>
#include <optional>

namespace slsd {
namespace {

using Kind = FileNode::Kind;

constexpr int kMaxDepth = 16;
constexpr std::size_t kMaxNodes = 50'000;
constexpr std::size_t kMaxKeys = 256;

std::optional<double> number_in(std::string_view text) {
  const bool minus = text.starts_with('-');
  const std::string_view size = text.substr(minus || text.starts_with('+') ? 1 : 0);
  if (size == ".Nan" || size == ".NaN" || size == ".nan") return std::numeric_limits<double>::quiet_NaN();
  double value = std::numeric_limits<double>::infinity();
  if (size != ".Inf" && size != ".inf") {
    const char* const end = size.data() + size.size();
    if (size.empty() || size[0] == '-' || size[0] > '9')
      return std::nullopt;  // from_chars() also accepts "inf" and
                            // "nan"
    if (std::from_chars(size.data(), end, value).ptr != end) return std::nullopt;
  }
  return minus ? -value : value;
}

/// Comments out the %YAML line: OpenCV's line is no valid YAML directive, and the version does not matter here.
std::string without_version(std::string_view text) {
  constexpr std::string_view kMark = "\xef\xbb\xbf", kDirective = "%YAML";
  std::string plain(text.substr(text.starts_with(kMark) ? kMark.size() : 0));
  for (std::size_t line = 0; line < plain.size() && plain.compare(line, 3, "---") != 0;) {
    if (plain.compare(line, kDirective.size(), kDirective) == 0) {
      plain[line] = '#';
      break;
    }
    const std::size_t end = plain.find('\n', line);
    line = end == plain.npos ? plain.size() : end + 1;
  }
  return plain;
}

struct DeleteEvent {
  void operator()(yaml_event_t* event) const {
    yaml_event_delete(event);
    delete event;
  }
};
using Event = std::unique_ptr<yaml_event_t, DeleteEvent>;

std::string_view text_of(const yaml_char_t* text, std::size_t length) {
  return {reinterpret_cast<const char*>(text), length};
}

std::string name_of(const yaml_char_t* name) {
  return name == nullptr ? std::string() : reinterpret_cast<const char*>(name);
}

/// Builds the tree from libyaml's events. The first problem ends the events.
class TreeReader {
 public:
  explicit TreeReader(std::string_view text) : text_(without_version(text)) {
    yaml_parser_initialize(&parser_);
    yaml_parser_set_input_string(&parser_, reinterpret_cast<const unsigned char*>(text_.data()), text_.size());
  }
  TreeReader(const TreeReader&) = delete;
  TreeReader& operator=(const TreeReader&) = delete;
  ~TreeReader() { yaml_parser_delete(&parser_); }

  tl::expected<FileNode, SyntaxProblem> read() {
    FileNode root;
    for (Event event = next(); event && event->type != YAML_STREAM_END_EVENT; event = next()) {
      if (event->type != YAML_DOCUMENT_START_EVENT) continue;
      if (std::exchange(begun_, true)) {
        refuse(*event, "begins a second document: a calibration file has one");
        break;
      }
      if (const Event first = next()) root = node(*first, 0);
    }
    if (problem_) return tl::unexpected(*problem_);
    return root;
  }

 private:
  void refuse_at(const yaml_mark_t& mark, const std::string& what) {
    if (!problem_) problem_ = SyntaxProblem{static_cast<int>(mark.line) + 1, what};
  }
  void refuse(const yaml_event_t& event, const std::string& what) { refuse_at(event.start_mark, what); }

  /// The next event; null after the last.
  Event next() {
    if (problem_) return nullptr;
    auto made = std::make_unique<yaml_event_t>();
    if (yaml_parser_parse(&parser_, made.get()) != 0) return Event(made.release());
    const std::string what =
        "is not YAML: " + std::string(parser_.problem != nullptr ? parser_.problem : "out of memory");
    if (parser_.error == YAML_READER_ERROR) {  // this error has no position
      const auto bad = static_cast<std::ptrdiff_t>(std::min(parser_.problem_offset, text_.size()));
      problem_ = SyntaxProblem{static_cast<int>(std::count(text_.begin(), text_.begin() + bad, '\n')) + 1, what};
    } else {
      const bool ends = parser_.problem_mark.index >= text_.size();
      refuse_at(parser_.problem_mark, what + (ends ? "; is the file cut short?" : ""));
    }
    return nullptr;
  }

  FileNode node(const yaml_event_t& event, int depth) {
    if (++nodes_ > kMaxNodes) refuse(event, "holds too many values for a calibration");
    if (depth > kMaxDepth) refuse(event, "is nested too deeply for a calibration");
    if (problem_) return {};
    switch (event.type) {
      case YAML_SCALAR_EVENT:
        return keep(event.data.scalar.anchor, scalar(event));
      case YAML_SEQUENCE_START_EVENT:
        return keep(event.data.sequence_start.anchor, sequence(depth));
      case YAML_MAPPING_START_EVENT:
        return keep(event.data.mapping_start.anchor, map(depth));
      case YAML_ALIAS_EVENT:
        return repeated(event);
      default:
        return {};
    }
  }

  static FileNode scalar(const yaml_event_t& event) {
    const std::string_view value = text_of(event.data.scalar.value, event.data.scalar.length);
    if (event.data.scalar.style == YAML_PLAIN_SCALAR_STYLE) {
      if (value.empty() || value == "~" || value == "null") return {};
      if (const auto number = number_in(value)) return {.kind = Kind::kNumber, .number = *number};
    }
    return {.kind = Kind::kText, .text = std::string(value)};
  }

  FileNode sequence(int depth) {
    FileNode result{.kind = Kind::kSequence};
    for (Event event = next(); event && event->type != YAML_SEQUENCE_END_EVENT; event = next()) {
      result.items.push_back(node(*event, depth + 1));
    }
    return result;
  }

  FileNode map(int depth) {
    FileNode result{.kind = Kind::kMap};
    for (Event event = next(); event && event->type != YAML_MAPPING_END_EVENT; event = next()) {
      if (event->type != YAML_SCALAR_EVENT) return refuse(*event, "has a key that is not a string"), result;
      const std::string key(text_of(event->data.scalar.value, event->data.scalar.length));
      const bool twice = std::ranges::any_of(result.entries, [&](const auto& entry) { return entry.first == key; });
      if (twice) refuse(*event, key + " appears twice");
      if (result.entries.size() == kMaxKeys) refuse(*event, "has too many keys");
      if (const Event value = next()) result.entries.emplace_back(key, node(*value, depth + 1));
    }
    return result;
  }

  /// Stores a node with an anchor for its aliases.
  FileNode keep(const yaml_char_t* anchor, FileNode made) {
    if (anchor != nullptr) named_.insert_or_assign(name_of(anchor), std::pair(made, size_of(made)));
    return made;
  }

  FileNode repeated(const yaml_event_t& event) {
    const auto found = named_.find(name_of(event.data.alias.anchor));
    if (found == named_.end()) return refuse(event, "refers to an unknown anchor"), FileNode{};
    const auto& [value, size] = found->second;
    if (nodes_ += size; nodes_ > kMaxNodes) return refuse(event, "holds too many values for a calibration"), FileNode{};
    return value;
  }

  static std::size_t size_of(const FileNode& made) {
    std::size_t size = 1;
    for (const FileNode& item : made.items) size += size_of(item);
    for (const auto& [key, value] : made.entries) size += size_of(value);
    return size;
  }

  const std::string text_;
  yaml_parser_t parser_{};
  bool begun_ = false;
  std::size_t nodes_ = 0;
  std::map<std::string, std::pair<FileNode, std::size_t>> named_;
  std::optional<SyntaxProblem> problem_;
};

}  // namespace

const FileNode* FileNode::find(std::string_view key) const {
  const auto entry = std::ranges::find(entries, key, [](const auto& each) { return std::string_view(each.first); });
  return entry == entries.end() || entry->second.kind == Kind::kEmpty ? nullptr : &entry->second;
}

tl::expected<FileNode, SyntaxProblem> read_file_tree(std::string_view text) {
  return TreeReader(text).read();
}

}  // namespace slsd
