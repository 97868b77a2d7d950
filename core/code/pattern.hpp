// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/code/code_array.hpp"
#include "core/code/symbol.hpp"
#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

inline constexpr int kMinProjectorWidthPx = 640;
inline constexpr int kMaxProjectorWidthPx = 3840;
inline constexpr int kMinProjectorHeightPx = 360;
inline constexpr int kMaxProjectorHeightPx = 2160;
inline constexpr int kMaxSpacingPx = 16;

/// Options that determine a pattern: the keys of the configuration's [pattern] table, and the projector's size.
struct PatternOptions {
  int projector_width_px = 1280;  ///< 640 to 3840
  int projector_height_px = 800;  ///< 360 to 2160
  int symbol_size_px = 16;        ///< one of kSymbolSizesPx
  int spacing_px = 2;             ///< 1 to 16; dark gap between two symbols
  std::vector<int> symbols{};     ///< 2 to 8 different symbol numbers; letter i of the array is drawn as symbols[i]
  std::uint32_t seed = 1;
  ArrayMethod method = ArrayMethod::kNoRepeats;
  std::optional<int> minimum_distance{};
  bool half_turn_unique = false;
  std::optional<int> row_reach{};     ///< columns; see ArrayOptions
  std::optional<int> column_reach{};  ///< rows

  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const PatternOptions&, const PatternOptions&) = default;
};

/// The best symbols for a size, used if the user names none.
[[nodiscard]] std::vector<int> default_symbols(int symbol_size_px);

/// A pattern: the array and its layout on the projector. Cells are pitch_px() wide, cell (0, 0) at the top left; the
/// part beyond the projector's right and bottom edges is cut (Elahi et al. 2020, equations (5), (6)).
///
///     cell (row, column):   |<- pitch = size + spacing ->|
///                           |s/2|<- symbol_size_px ->|s/2|      (the odd pixel of the spacing on the right)
struct Pattern {
  PatternOptions options;
  CodeArray array;

  [[nodiscard]] int pitch_px() const { return options.symbol_size_px + options.spacing_px; }
  [[nodiscard]] int letters() const { return array.letters; }
  /// Number of columns and rows of fully visible symbols.
  [[nodiscard]] int whole_columns() const;
  [[nodiscard]] int whole_rows() const;
  /// Projector pixel of the symbol's top left pixel.
  [[nodiscard]] int symbol_left_px(int column) const { return column * pitch_px() + options.spacing_px / 2; }
  [[nodiscard]] int symbol_top_px(int row) const { return row * pitch_px() + options.spacing_px / 2; }
  /// Centre of the symbol's square, in projector pixels (its centroid lies elsewhere: see the decoder's prototypes).
  [[nodiscard]] double symbol_centre_u_px(int column) const {
    return symbol_left_px(column) + 0.5 * (options.symbol_size_px - 1);
  }
  [[nodiscard]] double symbol_centre_v_px(int row) const {
    return symbol_top_px(row) + 0.5 * (options.symbol_size_px - 1);
  }
};

/// Makes the array for the projector and lays out the symbols. An empty `symbols` means default_symbols().
/// @errors kInvalidArgument; kImpossible with the bound that forbids it
[[nodiscard]] Result<Pattern> make_pattern(PatternOptions options);

/// The exact image for the projector: 255 for lit pixels, 0 for dark ones.
[[nodiscard]] Grey8 draw_pattern(const Pattern& pattern);

/// Writes a pattern file: TOML with the options and the array itself, to keep and share.
[[nodiscard]] std::string write_pattern(const Pattern& pattern);

/// Reads a pattern file's text and checks sizes, letters, and the promised distance of the windows.
/// @errors kMalformed with line and key; kInvalidArgument; kMismatch
[[nodiscard]] Result<Pattern> read_pattern(std::string_view text, std::string_view name);

}  // namespace slsd
