// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/pattern.hpp"

#include <algorithm>
#include <cassert>

namespace slsd {
namespace {

Result<> in_range(const char* key, int value, int low, int high) {
  if (value >= low && value <= high) return {};
  return fail(ErrorCode::kInvalidArgument, std::string(key) + " must be " + std::to_string(low) + " to " +
                                               std::to_string(high) + ", not " + std::to_string(value));
}

Result<> check_symbols(const std::vector<int>& symbols) {
  const int count = static_cast<int>(symbols.size());
  if (count < kMinLetters || count > kMaxLetters)
    return fail(ErrorCode::kInvalidArgument, "symbols must name 2 to 8 symbols, not " + std::to_string(count));
  for (auto at = symbols.begin(); at != symbols.end(); ++at) {
    if (auto valid = in_range("each of symbols", *at, 1, kSymbolCount); !valid) return valid;
    if (std::find(symbols.begin(), at, *at) != at)
      return fail(ErrorCode::kInvalidArgument, "symbols must differ: " + std::to_string(*at) + " appears twice");
  }
  return {};
}

Result<> check_symbol_size(int size_px) {
  if (std::ranges::find(kSymbolSizesPx, size_px) != std::end(kSymbolSizesPx)) return {};
  return fail(ErrorCode::kInvalidArgument,
              "symbol_size_px must be 8, 10, 12, 14 or 16, not " + std::to_string(size_px));
}

ArrayOptions array_options(const PatternOptions& options) {
  return {.rows = array_extent(options.projector_height_px, options.symbol_size_px, options.spacing_px),
          .columns = array_extent(options.projector_width_px, options.symbol_size_px, options.spacing_px),
          .letters = static_cast<int>(options.symbols.size()),
          .seed = options.seed,
          .method = options.method,
          .minimum_distance = options.minimum_distance,
          .half_turn_unique = options.half_turn_unique,
          .row_reach = options.row_reach,
          .column_reach = options.column_reach};
}

int whole_cells(int projector_px, int first_px, int size_px, int pitch_px, int cells) {
  return std::min(cells, (projector_px - first_px - size_px) / pitch_px + 1);
}

void blit(const Grey8& symbol_image, int left_px, int top_px, Grey8& image) {
  const int right_px = std::min(left_px + symbol_image.width(), image.width());
  const int bottom_px = std::min(top_px + symbol_image.height(), image.height());
  for (int y = top_px; y < bottom_px; ++y)
    for (int x = left_px; x < right_px; ++x) image.at(x, y) = symbol_image.at(x - left_px, y - top_px) != 0 ? 255 : 0;
}

}  // namespace

Result<> PatternOptions::validate() const {
  if (auto valid = in_range("projector width_px", projector_width_px, kMinProjectorWidthPx, kMaxProjectorWidthPx);
      !valid)
    return valid;
  if (auto valid = in_range("projector height_px", projector_height_px, kMinProjectorHeightPx, kMaxProjectorHeightPx);
      !valid)
    return valid;
  if (auto valid = check_symbol_size(symbol_size_px); !valid) return valid;
  if (auto valid = in_range("spacing_px", spacing_px, 1, kMaxSpacingPx); !valid) return valid;
  if (!symbols.empty())
    if (auto valid = check_symbols(symbols); !valid) return valid;
  PatternOptions with_symbols = *this;
  if (symbols.empty()) with_symbols.symbols = default_symbols(symbol_size_px);
  return array_options(with_symbols).validate();
}

// Six letters: with five, runs of letters recur within 25 columns, or windows differ in fewer than three cells. The
// sets are among the best that ./run tables finds: see docs/alphabet.md.
std::vector<int> default_symbols(int symbol_size_px) {
  switch (symbol_size_px) {
    case 16:
    case 12:
      return {9, 11, 13, 14, 18, 19};
    case 14:
      return {11, 12, 13, 14, 16, 24};
    case 10:
      return {11, 12, 14, 18, 19, 23};
    default:
      return {9, 10, 11, 12, 18, 19};
  }
}

int Pattern::whole_columns() const {
  return whole_cells(options.projector_width_px, symbol_left_px(0), options.symbol_size_px, pitch_px(), array.columns);
}

int Pattern::whole_rows() const {
  return whole_cells(options.projector_height_px, symbol_top_px(0), options.symbol_size_px, pitch_px(), array.rows);
}

Result<Pattern> make_pattern(PatternOptions options) {
  if (auto valid = options.validate(); !valid) return tl::unexpected(valid.error());
  if (options.symbols.empty()) options.symbols = default_symbols(options.symbol_size_px);
  auto array = make_code_array(array_options(options));
  if (!array) return tl::unexpected(array.error());
  return Pattern{std::move(options), std::move(*array)};
}

Grey8 draw_pattern(const Pattern& pattern) {
  Grey8 image(pattern.options.projector_width_px, pattern.options.projector_height_px);
  std::vector<Grey8> symbol_images;
  for (const int number : pattern.options.symbols)
    symbol_images.push_back(draw_symbol(number, pattern.options.symbol_size_px));
  for (int row = 0; row < pattern.array.rows; ++row)
    for (int column = 0; column < pattern.array.columns; ++column)
      blit(symbol_images[static_cast<std::size_t>(pattern.array.at(row, column))], pattern.symbol_left_px(column),
           pattern.symbol_top_px(row), image);
  return image;
}

}  // namespace slsd
