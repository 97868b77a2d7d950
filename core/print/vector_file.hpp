// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cairo.h>

#include <functional>
#include <string>

#include <Eigen/Core>

#include "core/result.hpp"

namespace slsd {

inline constexpr const char* kTypeface = "@cairo:";  ///< built into Cairo: independent of a machine's fonts; ASCII

/// Draws in millimetres from the page's top left.
using DrawPage = std::function<void(cairo_t*)>;

/// A PDF's page and name.
struct PdfPage {
  Eigen::Vector2d size_mm;
  std::string title;
};

/// Draws one page as a vector file's bytes.
/// @errors kIo: the drawing library failed
/// @thread reentrant
[[nodiscard]] Result<std::string> draw_pdf(const PdfPage& page, const DrawPage& draw);
[[nodiscard]] Result<std::string> draw_svg(const Eigen::Vector2d& size_mm, const DrawPage& draw);

/// Draws on a surface with so many units per millimetre. @errors kIo: the drawing library failed
[[nodiscard]] Result<> draw_on(cairo_surface_t* surface, double scale, const DrawPage& draw);

}  // namespace slsd
