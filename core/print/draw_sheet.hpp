// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/image.hpp"
#include "core/print/sheet.hpp"
#include "core/result.hpp"

namespace slsd {

/// Draws a sheet as a vector file's bytes: of the paper's size, black on white, with Cairo's built-in font.
/// @errors kIo (the drawing library failed)
/// @thread reentrant
[[nodiscard]] Result<std::string> sheet_pdf(const Sheet& sheet);
[[nodiscard]] Result<std::string> sheet_svg(const Sheet& sheet);

/// Draws a sheet as pixels, white 255. A position at x mm of the sheet is at x * dpi / 25.4 - 0.5.
/// @param dpi  pixels per inch, 20 to 2400
/// @errors kInvalidArgument (more pixels than an image can have), kIo (the drawing library failed)
/// @thread reentrant
[[nodiscard]] Result<Grey8> sheet_image(const Sheet& sheet, double dpi);

}  // namespace slsd
