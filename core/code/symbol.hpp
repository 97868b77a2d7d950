// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/code/alphabet.hpp"
#include "core/image.hpp"

namespace slsd {

/// The symbol with this number.
/// @param number  1 to 25; other numbers are a bug of the caller
[[nodiscard]] const Symbol& symbol(int number);

/// Draws a symbol in its cell: size_px x size_px, 1 for lit pixels, 0 for dark ones.
/// @param number   1 to 25
/// @param size_px  one of kSymbolSizesPx
[[nodiscard]] Grey8 draw_symbol(int number, int size_px);

}  // namespace slsd
