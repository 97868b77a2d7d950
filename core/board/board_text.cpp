// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "core/board/board.hpp"

namespace slsd {
namespace {

struct BoardForm {
  BoardKind kind;
  std::string_view name;
  std::string_view form;
  std::size_t fields;
};
constexpr std::array kForms{
    BoardForm{BoardKind::kCharuco, "charuco", "charuco:COLSxROWS:SQUARE_MM:MARKER_MM:DICTIONARY", 5},
    BoardForm{BoardKind::kChessboard, "chessboard", "chessboard:COLSxROWS:SQUARE_MM", 3},
    BoardForm{BoardKind::kCircles, "circles", "circles:COLSxROWS:SPACING_MM:DIAMETER_MM", 4},
    BoardForm{BoardKind::kPlane, "plane", "plane:COLSxROWS:PITCH_MM:MARKER_MM:DICTIONARY", 5},
};
constexpr int kMaxCount = 200;
constexpr double kMaxLengthMm = 10000;

std::vector<std::string_view> fields_of(std::string_view text) {
  std::vector<std::string_view> fields;
  for (std::size_t end = 0; end != text.npos; text.remove_prefix(end == text.npos ? 0 : end + 1)) {
    end = text.find(':');
    fields.push_back(text.substr(0, end));
  }
  return fields;
}

template <class Number>
std::optional<Number> number(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

bool read_counts(std::string_view text, Board& board) {
  const auto middle = text.find('x');
  if (middle == text.npos) return false;
  const auto columns = number<int>(text.substr(0, middle));
  const auto rows = number<int>(text.substr(middle + 1));
  if (columns) board.columns = *columns;
  if (rows) board.rows = *rows;
  return columns && rows;
}

bool read_length(std::string_view text, double& length_mm) {
  const auto value = number<double>(text);
  if (value) length_mm = *value;
  return value.has_value();
}

template <class Names>
std::string listed(const Names& all, std::string_view (*name_of)(const typename Names::value_type&)) {
  std::string list;
  for (const auto& one : all) {
    if (!list.empty()) list += ", ";
    list += name_of(one);
  }
  return list;
}

std::string forms() {
  return listed(kForms, [](const BoardForm& form) { return form.form; });
}

std::string family_names() {
  return listed(marker_families(), [](const MarkerFamily& family) { return family.name; });
}

auto refuse(std::string_view text, const std::string& why) {
  return fail(ErrorCode::kInvalidArgument, "the board \"" + std::string(text) + "\" is not possible: " + why);
}

Result<Board> check_marks(std::string_view text, const Board& board) {
  if (board.kind == BoardKind::kChessboard) return board;
  if (!(board.mark_mm > 0)) return refuse(text, "markers and discs must be larger than 0 mm");
  if (board.kind == BoardKind::kCircles && board.mark_mm >= std::sqrt(2) * board.pitch_mm) {
    return refuse(text, "discs must be smaller than 1.41 times the spacing, or they touch");
  }
  if (board.kind != BoardKind::kCircles && board.mark_mm >= board.pitch_mm) {
    return refuse(text, "a marker must be smaller than its square");
  }
  if (board.family && board.marker_count() > board.family->count) {
    return refuse(text, "it needs " + std::to_string(board.marker_count()) + " markers, but " +
                            std::string(board.family->name) + " has " + std::to_string(board.family->count));
  }
  return board;
}

Result<Board> check(std::string_view text, const Board& board) {
  const int least = board.kind == BoardKind::kPlane ? 2 : 3;
  if (board.columns < least || board.rows < least || board.columns > kMaxCount || board.rows > kMaxCount) {
    return refuse(text, "columns and rows must be " + std::to_string(least) + " to " + std::to_string(kMaxCount));
  }
  if (!(board.pitch_mm > 0 && board.pitch_mm <= kMaxLengthMm)) {
    return refuse(text, "lengths must be more than 0 and at most 10000 mm");
  }
  return check_marks(text, board);
}

std::string millimetres(double length_mm) {
  std::array<char, 32> digits{};
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), length_mm).ptr};
}

}  // namespace

Result<Board> parse_board(std::string_view text) {
  const auto fields = fields_of(text);
  for (const BoardForm& form : kForms) {
    if (fields[0] != form.name) continue;
    Board board{.kind = form.kind};
    const bool read = fields.size() == form.fields && read_counts(fields[1], board) &&
                      read_length(fields[2], board.pitch_mm) &&
                      (form.fields < 4 || read_length(fields[3], board.mark_mm));
    if (!read) {
      return fail(ErrorCode::kMalformed, "the board \"" + std::string(text) + "\" does not have the form " +
                                             std::string(form.form) + ", with lengths such as 25.4");
    }
    if (form.fields == 5 && !(board.family = find_marker_family(fields[4]))) {
      return fail(ErrorCode::kMalformed,
                  "unknown marker dictionary \"" + std::string(fields[4]) + "\"; known are " + family_names());
    }
    return check(text, board);
  }
  return fail(ErrorCode::kMalformed,
              "the board \"" + std::string(text) + "\" has an unknown form; known are " + forms());
}

std::string to_string(const Board& board) {
  const auto& form = kForms.at(static_cast<std::size_t>(board.kind));
  std::string text = std::string(form.name) + ":" + std::to_string(board.columns) + "x" + std::to_string(board.rows) +
                     ":" + millimetres(board.pitch_mm);
  if (form.fields > 3) text += ":" + millimetres(board.mark_mm);
  if (board.family) text += ":" + std::string(board.family->name);
  return text;
}

std::string describe(const Board& board) {
  std::string text = "the board \"";
  text += to_string(board);
  return text += '"';
}

}  // namespace slsd
