// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/file_syntax.hpp"

#include <algorithm>

namespace slsd {
namespace {

constexpr std::size_t kMaxLineLength = 1024;
constexpr std::size_t kMaxIndent = 64;
constexpr std::string_view kNumber = "0123456789+-.eEnNaAiIfF";
constexpr std::string_view kWord = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_";
// What OpenCV writes without quotes.
constexpr std::string_view kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_.+-/(); ";

bool is_text(char letter) {
  const auto byte = static_cast<unsigned char>(letter);
  return byte >= 0x20 && byte != 0x7f;
}

// What is left of a line, taken from its front piece by piece.
class Rest {
 public:
  explicit Rest(std::string_view line) : line_(line) {}

  [[nodiscard]] bool starts_with(std::string_view word) const { return line_.substr(0, word.size()) == word; }
  [[nodiscard]] bool take(std::string_view word) {
    if (!starts_with(word)) return false;
    line_.remove_prefix(word.size());
    return true;
  }
  std::size_t take_all_of(std::string_view letters) {
    const std::size_t count = std::min(line_.find_first_not_of(letters), line_.size());
    line_.remove_prefix(count);
    return count;
  }
  // "text" with only the escapes of quote and backslash: the reader writes past the end on others.
  [[nodiscard]] bool take_quoted() {
    if (!take("\"")) return false;
    while (!line_.empty() && line_[0] != '"') {
      const bool escape = line_[0] == '\\';
      if (escape && (line_.size() < 2 || (line_[1] != '"' && line_[1] != '\\' && line_[1] != '\''))) return false;
      line_.remove_prefix(escape ? 2 : 1);
    }
    return take("\"");
  }
  // The rest of a list of numbers; whether it is closed comes back in `open`.
  [[nodiscard]] bool take_list(bool& open) {
    bool took = true;
    while (took) took = take_all_of(" ") + take_all_of(kNumber) > 0 || take(",");
    open = !take("]");
    return ends();
  }
  [[nodiscard]] bool ends() {
    take_all_of(" ");
    return line_.empty() || line_[0] == '#';
  }

 private:
  std::string_view line_;
};

// Goes from line to line and knows what may come next.
class Grammar {
 public:
  // Whether the line may come here.
  bool accepts(std::string_view line) {
    if (!begun_) return begun_ = line.substr(0, 8) == "%YAML:1." || line.substr(0, 8) == "%YAML 1.";
    Rest rest(line);
    if (list_open_) return rest.take_list(list_open_);
    if (!separated_ && rest.take("---")) return separated_ = true, rest.ends();
    if (rest.take_all_of(" ") > kMaxIndent) return false;
    if (rest.ends()) return true;
    if (rest.take("[")) return rest.take_list(list_open_);
    if (rest.take("-") && rest.take_all_of(" ") == 0) return rest.ends();
    return rest.ends() || accepts_key(rest);
  }
  [[nodiscard]] bool complete() const { return separated_ && !list_open_; }

 private:
  bool accepts_key(Rest& rest) {
    if (rest.take_all_of(kWord) == 0 || !rest.take(":")) return false;
    if (rest.take_all_of(" ") == 0) return rest.ends();
    if (rest.take("[")) return rest.take_list(list_open_);
    if (rest.starts_with("\"")) return rest.take_quoted() && rest.ends();
    if (rest.starts_with("- ")) return false;
    if (!rest.take("!!opencv-matrix")) rest.take_all_of(kPlain);
    return rest.ends();
  }
  bool begun_ = false;
  bool separated_ = false;
  bool list_open_ = false;
};

std::string_view without_return(std::string_view line) {
  return !line.empty() && line.back() == '\r' ? line.substr(0, line.size() - 1) : line;
}

}  // namespace

std::optional<SyntaxProblem> syntax_problem(std::string_view text) {
  Grammar grammar;
  int number = 0;
  do {
    const std::string_view whole = text.substr(0, text.find('\n'));
    const std::string_view line = without_return(whole);
    text.remove_prefix(std::min(whole.size() + 1, text.size()));
    ++number;
    const bool fits = line.size() <= kMaxLineLength && std::all_of(line.begin(), line.end(), is_text);
    if (!fits || !grammar.accepts(line)) {
      return SyntaxProblem{number, number == 1 ? "is no calibration file: it has to begin with %YAML:1.0"
                                               : "is not a line of a calibration file as OpenCV writes it"};
    }
  } while (!text.empty());
  if (!grammar.complete()) return SyntaxProblem{number, "ends too early: is the file cut short?"};
  return std::nullopt;
}

}  // namespace slsd
