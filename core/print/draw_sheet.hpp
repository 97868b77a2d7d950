// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/image.hpp"
#include "core/print/sheet.hpp"
#include "core/result.hpp"

namespace slsd {

/// A sheet as a file's bytes: vectors, of the paper's size, black on white, with letters of Cairo's own.
/// @errors kIo (the drawing library failed)
/// @thread reentrant
[[nodiscard]] Result<std::string> sheet_pdf(const Sheet& sheet);
[[nodiscard]] Result<std::string> sheet_svg(const Sheet& sheet);

/// A sheet as pixels, white 255. A place at x mm of the sheet is at x * dpi / 25.4 - 0.5.
/// @param dpi  pixels to an inch, 20 to 2400
/// @errors kInvalidArgument (of so many pixels no image can be), kIo (the drawing library failed)
/// @thread reentrant
[[nodiscard]] Result<Grey8> sheet_image(const Sheet& sheet, double dpi);

}  // namespace slsd
