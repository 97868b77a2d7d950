// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <array>
#include <iterator>
#include <limits>

#include "core/code/arrays/paper_array.hpp"
#include "core/code/arrays/runs.hpp"
#include "core/code/key_reader.hpp"
#include "core/code/pattern.hpp"

namespace slsd {
namespace {

constexpr std::size_t kMaxTextBytes = 1 << 20;  // the largest array, 512x512, is a quarter of that

constexpr std::array<std::string_view, 3> kTables = {"projector", "pattern", "array"};
constexpr std::array<std::string_view, 2> kProjectorKeys = {"width_px", "height_px"};
constexpr std::array<std::string_view, 9> kPatternKeys = {
    "symbol_size_px",   "spacing_px",       "symbols",   "seed",        "method",
    "minimum_distance", "half_turn_unique", "row_reach", "column_reach"};
constexpr std::array<std::string_view, 6> kArrayKeys = {"rows",      "columns",      "minimum_distance",
                                                        "row_reach", "column_reach", "letters"};

std::string list_of(const std::vector<int>& numbers) {
  std::string text;
  for (const int number : numbers) text += (text.empty() ? "" : ", ") + std::to_string(number);
  return "[" + text + "]";
}

std::string row_of_letters(const CodeArray& array, int row) {
  std::string letters;
  for (int column = 0; column < array.columns; ++column) letters += static_cast<char>('0' + array.at(row, column));
  return letters;
}

std::string options_in_toml(const PatternOptions& options) {
  std::string text = "[projector]\nwidth_px = " + std::to_string(options.projector_width_px) +
                     "\nheight_px = " + std::to_string(options.projector_height_px) +
                     "\n\n[pattern]\nsymbol_size_px = " + std::to_string(options.symbol_size_px) +
                     "\nspacing_px = " + std::to_string(options.spacing_px) +
                     "\nsymbols = " + list_of(options.symbols) + "\nseed = " + std::to_string(options.seed) +
                     "\nmethod = \"" + std::string(to_string(options.method)) + "\"\n";
  const auto add = [&text](const char* key, std::optional<int> value) {
    if (value) text += std::string(key) + " = " + std::to_string(*value) + "\n";
  };
  add("minimum_distance", options.minimum_distance);
  add("row_reach", options.row_reach);
  add("column_reach", options.column_reach);
  return text + "half_turn_unique = " + (options.half_turn_unique ? "true" : "false") + "\n";
}

std::string reach_in_toml(const Pattern& pattern) {
  if (pattern.options.method != ArrayMethod::kNoRepeats) return {};
  return "# Columns within which no run of letters recurs in its row, and rows within which none does in its column.\n"
         "row_reach = " +
         std::to_string(pattern.array.row_reach) + "\ncolumn_reach = " + std::to_string(pattern.array.column_reach) +
         "\n";
}

ArrayMethod read_method(KeyReader& reader, const toml::table& table) {
  const std::string name = reader.string(table, "method");
  for (const ArrayMethod method : {ArrayMethod::kPaper, ArrayMethod::kConstructive, ArrayMethod::kNoRepeats})
    if (name == to_string(method)) return method;
  if (!reader.error())
    reader.refuse(*table.get("method"), ErrorCode::kInvalidArgument,
                  "\"method\" must be \"constructive\", \"no_repeats\" or \"paper\"");
  return ArrayMethod::kConstructive;
}

int read_int(KeyReader& reader, const toml::table& table, std::string_view key, int low, int high) {
  return static_cast<int>(reader.integer(table, key, low, high));
}

PatternOptions read_options(KeyReader& reader, const toml::table& projector, const toml::table& pattern) {
  PatternOptions options;
  options.projector_width_px = read_int(reader, projector, "width_px", kMinProjectorWidthPx, kMaxProjectorWidthPx);
  options.projector_height_px = read_int(reader, projector, "height_px", kMinProjectorHeightPx, kMaxProjectorHeightPx);
  options.symbol_size_px = read_int(reader, pattern, "symbol_size_px", kSymbolSizesPx[0], *std::rbegin(kSymbolSizesPx));
  options.spacing_px = read_int(reader, pattern, "spacing_px", 1, kMaxSpacingPx);
  options.symbols = reader.integers(pattern, "symbols", kMaxLetters);
  options.seed =
      static_cast<std::uint32_t>(reader.integer(pattern, "seed", 0, std::numeric_limits<std::uint32_t>::max()));
  options.method = read_method(reader, pattern);
  if (pattern.contains("minimum_distance"))
    options.minimum_distance = read_int(reader, pattern, "minimum_distance", 1, kWindowCells);
  if (pattern.contains("row_reach")) options.row_reach = read_int(reader, pattern, "row_reach", 0, kMaxArrayExtent);
  if (pattern.contains("column_reach"))
    options.column_reach = read_int(reader, pattern, "column_reach", 0, kMaxArrayExtent);
  options.half_turn_unique = reader.boolean(pattern, "half_turn_unique");
  if (auto valid = options.validate(); !valid) reader.refuse(pattern, valid.error().code, valid.error().message);
  if (options.symbols.empty()) reader.refuse(pattern, ErrorCode::kInvalidArgument, "symbols must name 2 to 8 symbols");
  return options;
}

void read_row(KeyReader& reader, const toml::table& table, const std::string& letters, CodeArray& array) {
  if (letters.size() != static_cast<std::size_t>(array.columns))
    reader.refuse(table, ErrorCode::kMismatch,
                  "each row of \"letters\" must have " + std::to_string(array.columns) + " letters, not " +
                      std::to_string(letters.size()));
  for (const char letter : letters) {
    if (letter < '0' || letter >= '0' + array.letters)
      reader.refuse(table, ErrorCode::kInvalidArgument,
                    "\"letters\" must be digits from 0 to " + std::to_string(array.letters - 1) +
                        ", one for each of the pattern's symbols");
    array.cells.push_back(static_cast<std::uint8_t>(letter - '0'));
  }
}

CodeArray read_array(KeyReader& reader, const toml::table& table, const PatternOptions& options) {
  CodeArray array;
  array.rows = read_int(reader, table, "rows", kWindowSide, kMaxArrayExtent);
  array.columns = read_int(reader, table, "columns", kWindowSide, kMaxArrayExtent);
  array.letters = static_cast<int>(options.symbols.size());
  const int rows = array_extent(options.projector_height_px, options.symbol_size_px, options.spacing_px);
  const int columns = array_extent(options.projector_width_px, options.symbol_size_px, options.spacing_px);
  if (array.rows != rows || array.columns != columns)
    reader.refuse(table, ErrorCode::kMismatch,
                  "this projector, symbol size and spacing need an array of " + std::to_string(rows) + " rows and " +
                      std::to_string(columns) + " columns");
  const auto letters = reader.strings(table, "letters", kMaxArrayExtent);
  if (letters.size() != static_cast<std::size_t>(array.rows))
    reader.refuse(
        table, ErrorCode::kMismatch,
        "\"letters\" must have " + std::to_string(array.rows) + " rows, not " + std::to_string(letters.size()));
  for (const std::string& row : letters) read_row(reader, table, row, array);
  return array;
}

void check_reach(KeyReader& reader, const toml::table& table, Pattern& pattern) {
  CodeArray& array = pattern.array;
  const auto promised = [&](const char* key, std::optional<int> asked, int cells) {
    return std::max(read_int(reader, table, key, 0, kMaxArrayExtent),
                    std::min(asked.value_or(0), cells - kShortestRun));
  };
  const int row_reach = promised("row_reach", pattern.options.row_reach, array.columns),
            column_reach = promised("column_reach", pattern.options.column_reach, array.rows);
  array.row_reach = repeat_free_reach(array, Along::kRows);
  array.column_reach = repeat_free_reach(array, Along::kColumns);
  if (array.row_reach < row_reach || array.column_reach < column_reach)
    reader.refuse(table, ErrorCode::kMismatch,
                  "runs of \"letters\" recur after " + std::to_string(array.row_reach + 1) + " columns or " +
                      std::to_string(array.column_reach + 1) +
                      " rows, sooner than the file states: a letter was changed; create the pattern again");
}

// Recompute what the file promises: a letter changed by hand or in transit must not cause a wrong point.
void check_promises(KeyReader& reader, const toml::table& table, Pattern& pattern) {
  const int promised = read_int(reader, table, "minimum_distance", 0, kWindowCells);
  if (reader.error()) return;
  const int found = minimum_window_distance(pattern.array, pattern.options.half_turn_unique);
  pattern.array.minimum_distance = found;
  if (found < std::max(promised, pattern.options.minimum_distance.value_or(0)))
    reader.refuse(table, ErrorCode::kMismatch,
                  "the windows of \"letters\" have minimum distance " + std::to_string(found) +
                      ", less than the file states: a letter was changed; create the pattern again");
  if (pattern.options.method == ArrayMethod::kPaper && !aligned_windows_differ(pattern.array))
    reader.refuse(table, ErrorCode::kMismatch,
                  "two aligned windows of \"letters\" are equal: a letter was changed; create the pattern again");
  if (pattern.options.method != ArrayMethod::kPaper && found < 1)
    reader.refuse(table, ErrorCode::kMismatch,
                  "two windows of \"letters\" are equal: a letter was changed; create the pattern again");
  if (pattern.options.method == ArrayMethod::kNoRepeats) return check_reach(reader, table, pattern);
  if (table.contains("row_reach") || table.contains("column_reach"))
    reader.refuse(table, ErrorCode::kInvalidArgument, "row_reach and column_reach need method = \"no_repeats\"");
}

Result<Pattern> pattern_from(const toml::table& document, std::string_view name) {
  KeyReader reader(name);
  reader.only(document, kTables);
  const toml::table& projector = reader.table(document, "projector");
  const toml::table& pattern = reader.table(document, "pattern");
  const toml::table& array = reader.table(document, "array");
  reader.only(projector, kProjectorKeys);
  reader.only(pattern, kPatternKeys);
  reader.only(array, kArrayKeys);
  Pattern read;
  if (!reader.error()) read.options = read_options(reader, projector, pattern);
  if (!reader.error()) read.array = read_array(reader, array, read.options);
  if (!reader.error()) check_promises(reader, array, read);
  if (reader.error()) return tl::unexpected(*reader.error());
  return read;
}

}  // namespace

std::string write_pattern(const Pattern& pattern) {
  const CodeArray& array = pattern.array;
  std::string text = "# A pattern of slsd. Letter i of the array is shown as symbols[i].\n" +
                     options_in_toml(pattern.options) + "\n[array]\nrows = " + std::to_string(array.rows) +
                     "\ncolumns = " + std::to_string(array.columns) + "\n# Hamming, between any two 3x3 windows.\n" +
                     "minimum_distance = " + std::to_string(array.minimum_distance) + "\n" + reach_in_toml(pattern) +
                     "letters = [\n";
  for (int row = 0; row < array.rows; ++row) text += "  \"" + row_of_letters(array, row) + "\",\n";
  return text + "]\n";
}

Result<Pattern> read_pattern(std::string_view text, std::string_view name) {
  if (text.size() > kMaxTextBytes)
    return fail(ErrorCode::kMalformed, "too large for a pattern file", std::string(name));
  try {
    return pattern_from(toml::parse(text, name), name);
  } catch (const toml::parse_error& error) {
    return fail(ErrorCode::kMalformed, "not a TOML file: " + std::string(error.description()),
                std::string(name) + ":" + std::to_string(error.source().begin.line));
  }
}

}  // namespace slsd
