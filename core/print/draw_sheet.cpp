// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/print/draw_sheet.hpp"

#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "core/board/board_ink.hpp"
#include "core/print/vector_file.hpp"

namespace slsd {
namespace {

constexpr int kMaxSidePx = 32767;  // largest side of Cairo's images
constexpr double kTextHeightMm = 3;
constexpr double kNumberHeightMm = 2.2;
constexpr double kTextBelowRulerMm = 9.5;
constexpr double kLineMm = 0.12;

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;

// One path for all shapes, so that no seam shows between the rectangles of a marker.
void draw_ink(cairo_t* pen, const Board& board) {
  const BoardInk ink = ink_of(board);
  for (const auto& r : ink.rectangles) cairo_rectangle(pen, r.x_mm, r.y_mm, r.width_mm, r.height_mm);
  for (const auto& d : ink.discs) {
    cairo_new_sub_path(pen);
    cairo_arc(pen, d.x_mm, d.y_mm, d.diameter_mm / 2, 0, 2 * std::numbers::pi);
  }
  cairo_fill(pen);
}

double tick_length(int mm) {
  return mm % 10 == 0 ? 3.2 : mm % 5 == 0 ? 2.2 : 1.4;
}

void draw_number(cairo_t* pen, int mm) {
  const std::string text = std::to_string(mm);
  cairo_text_extents_t extents;
  cairo_text_extents(pen, text.c_str(), &extents);
  cairo_move_to(pen, mm - extents.width / 2 - extents.x_bearing, tick_length(0) + 0.6 + extents.height);
  cairo_show_text(pen, text.c_str());
}

// Along x from 0, ticks towards positive y.
void draw_ruler(cairo_t* pen, double length_mm) {
  cairo_set_line_width(pen, kLineMm);
  for (int mm = 0; mm <= length_mm + 1e-6; ++mm) {
    cairo_move_to(pen, mm, 0);
    cairo_line_to(pen, mm, tick_length(mm));
  }
  cairo_stroke(pen);
  cairo_set_font_size(pen, kNumberHeightMm);
  for (int mm = 0; mm <= length_mm + 1e-6; mm += 10) draw_number(pen, mm);
}

void draw_rulers(cairo_t* pen, const Sheet& sheet) {
  cairo_save(pen);
  cairo_translate(pen, 0, sheet.board.height_mm() + sheet.clear_mm);
  draw_ruler(pen, sheet.board.width_mm());
  cairo_restore(pen);
  cairo_save(pen);
  cairo_translate(pen, -sheet.clear_mm, 0);
  cairo_rotate(pen, std::numbers::pi / 2);
  draw_ruler(pen, sheet.board.height_mm());
  cairo_restore(pen);
}

void draw_text(cairo_t* pen, const Sheet& sheet) {
  const std::string text =
      to_string(sheet.board) + "    print at 100 %, not \"fit to page\"; then measure both rulers: they are in mm";
  cairo_set_font_size(pen, kTextHeightMm);
  cairo_text_extents_t extents;
  cairo_text_extents(pen, text.c_str(), &extents);
  const double shrunk = std::min(1.0, sheet.board.width_mm() / extents.x_advance);
  cairo_set_font_size(pen, shrunk * kTextHeightMm);
  cairo_move_to(pen, 0, sheet.board.height_mm() + sheet.clear_mm + kTextBelowRulerMm);
  cairo_show_text(pen, text.c_str());
}

// In units of mm from the sheet's top left.
void draw(cairo_t* pen, const Sheet& sheet) {
  cairo_select_font_face(pen, kTypeface, CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_translate(pen, sheet.origin_mm.x(), sheet.origin_mm.y());
  cairo_set_source_rgb(pen, 0, 0, 0);
  draw_ink(pen, sheet.board);
  draw_rulers(pen, sheet);
  draw_text(pen, sheet);
}

}  // namespace

Result<std::string> sheet_pdf(const Sheet& sheet) {
  return draw_pdf({{sheet.paper.width_mm, sheet.paper.height_mm}, to_string(sheet.board)},
                  [&](cairo_t* pen) { draw(pen, sheet); });
}

Result<std::string> sheet_svg(const Sheet& sheet) {
  return draw_svg({sheet.paper.width_mm, sheet.paper.height_mm}, [&](cairo_t* pen) { draw(pen, sheet); });
}

Result<Grey8> sheet_image(const Sheet& sheet, double dpi) {
  const double width = std::round(sheet.paper.width_mm / 25.4 * dpi);
  const double height = std::round(sheet.paper.height_mm / 25.4 * dpi);
  if (!(std::max(width, height) <= kMaxSidePx) || !(std::min(width, height) >= 1)) {
    return fail(ErrorCode::kInvalidArgument, "the sheet would exceed 32767 px on a side; give a smaller --dpi");
  }
  Grey8 image(static_cast<int>(width), static_cast<int>(height));
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_A8, image.width(), image.height()),
                        cairo_surface_destroy);
  const auto drawn = draw_on(surface.get(), dpi / 25.4, [&](cairo_t* pen) { draw(pen, sheet); });
  if (!drawn) return tl::unexpected(drawn.error());
  cairo_surface_flush(surface.get());
  const unsigned char* ink = cairo_image_surface_get_data(surface.get());
  for (int y = 0; y < image.height(); ++y, ink += cairo_image_surface_get_stride(surface.get())) {
    for (int x = 0; x < image.width(); ++x) image.at(x, y) = static_cast<std::uint8_t>(255 - ink[x]);
  }
  return image;
}

}  // namespace slsd
