// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/datasheet/draw_datasheet.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "core/print/vector_file.hpp"

namespace slsd {
namespace {

constexpr double kWidthMm = 210, kHeightMm = 297, kMarginMm = 18;
constexpr double kTitleMm = 6, kTextMm = 3, kSmallMm = 2.4, kFineMm = 2, kLeading = 1.6;
constexpr double kStripMm = 15;  // height of a quantity's dots
constexpr std::array kColumnsMm{0.0, 52.0, 104.0, 118.0, 136.0, 154.0};

// Where a line of text may be.
struct Room {
  double x_mm = 0, width_mm = kWidthMm - 2 * kMarginMm;
};

// Writes from the top down.
class Page {
 public:
  explicit Page(cairo_t* pen) : pen_(pen) {
    cairo_set_source_rgb(pen_, 1, 1, 1);
    cairo_paint(pen_);
    cairo_select_font_face(pen_, kTypeface, CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    ink(0);
  }

  void ink(double grey) { cairo_set_source_rgb(pen_, grey, grey, grey); }
  void down(double mm) { y_ += mm; }

  // Words that are too long for their room are smaller.
  void text(const std::string& words, double size_mm, Room place = {}) {
    cairo_set_font_size(pen_, size_mm);
    cairo_text_extents_t extents;
    cairo_text_extents(pen_, words.c_str(), &extents);
    const double room = std::min(place.width_mm, kWidthMm - 2 * kMarginMm - place.x_mm);
    if (extents.x_advance > room) cairo_set_font_size(pen_, size_mm * room / extents.x_advance);
    cairo_move_to(pen_, kMarginMm + place.x_mm, y_ + size_mm);
    cairo_show_text(pen_, words.c_str());
  }
  void line_of_text(const std::string& words, double size_mm) { text(words, size_mm), down(kLeading * size_mm); }

  void rule() {
    cairo_set_line_width(pen_, 0.2);
    cairo_move_to(pen_, kMarginMm, y_);
    cairo_line_to(pen_, kWidthMm - kMarginMm, y_);
    cairo_stroke(pen_);
    down(1.2);
  }

  // The values of a quantity as dots over places, zero as a line, and the interval of the mean as a band.
  void strip(const Quantity& quantity) {
    const double left = kMarginMm + kColumnsMm[1], width = kWidthMm - kMarginMm - left, height = kStripMm - 4;
    double low = 0, high = 0;
    for (const double value : quantity.values) low = std::min(low, value), high = std::max(high, value);
    if (std::isfinite(quantity.summary.low)) {
      low = std::min(low, quantity.summary.low), high = std::max(high, quantity.summary.high);
    }
    const double span = high > low ? high - low : 1;
    const auto level = [&](double value) { return y_ + 2 + height * (high - value) / span; };
    text(quantity.name, kSmallMm);
    down(kLeading * kSmallMm);
    text(fmt::format("{} to {} {}", signed_text(low), signed_text(high), quantity.unit), kSmallMm);
    down(-kLeading * kSmallMm);
    if (std::isfinite(quantity.summary.low)) {
      ink(0.85);
      cairo_rectangle(pen_, left, level(quantity.summary.high), width,
                      level(quantity.summary.low) - level(quantity.summary.high));
      cairo_fill(pen_);
    }
    ink(0.5);
    cairo_set_line_width(pen_, 0.15);
    cairo_move_to(pen_, left, level(0)), cairo_line_to(pen_, left + width, level(0));
    cairo_stroke(pen_);
    ink(0);
    for (std::size_t i = 0; i < quantity.values.size(); ++i) {
      const double x = left + width * (static_cast<double>(i) + 0.5) / static_cast<double>(quantity.values.size());
      cairo_arc(pen_, x, level(quantity.values[i]), 0.7, 0, 2 * std::numbers::pi);
      cairo_fill(pen_);
    }
    down(kStripMm);
  }

  // Lines in two columns, one below the other; the last one counts those that do not fit.
  void columns(const std::vector<std::string>& lines) {
    const double leading = kLeading * kFineMm, top = y_;
    const auto rows = static_cast<std::size_t>((kHeightMm - kMarginMm - y_) / leading);
    const std::size_t shown = lines.size() <= 2 * rows ? lines.size() : 2 * rows - 1;
    for (std::size_t i = 0; i < shown; ++i) {
      if (i == rows) y_ = top;
      text(lines[i], kFineMm, {i < rows ? 0 : kColumnsMm[1] + 38, kColumnsMm[1] + 34});
      down(leading);
    }
    if (shown < lines.size()) text(fmt::format("and {} more", lines.size() - shown), kFineMm, {kColumnsMm[1] + 38});
  }

  void row(const std::array<std::string, kColumnsMm.size()>& cells) {
    for (std::size_t i = 0; i < cells.size(); ++i) text(cells[i], kSmallMm, {kColumnsMm[i]});
    down(kLeading * kSmallMm);
  }

 private:
  cairo_t* pen_;
  double y_ = kMarginMm;
};

void draw(Page& page, const DataSheet& sheet) {
  page.line_of_text("Data sheet of a structured-light scanner", kTitleMm);
  for (const std::string& fact : sheet.facts) page.line_of_text(fact, kTextMm);
  page.down(3);
  page.row({"figure", "defined as in", "places", "worst", "mean", "95 % of the mean"});
  page.rule();
  for (const Quantity& quantity : sheet.quantities) {
    const Summary& summary = quantity.summary;
    page.row({quantity.name + (quantity.unit.empty() ? "" : ", " + quantity.unit), quantity.source,
              std::to_string(summary.places), signed_text(summary.worst), signed_text(summary.mean),
              signed_text(summary.low) + " to " + signed_text(summary.high)});
  }
  page.rule();
  page.down(3);
  for (const Quantity& quantity : sheet.quantities) page.strip(quantity);
  page.line_of_text("Dots: the value at each place. Band: 95 % interval of the mean. Line: zero.", kSmallMm);
  page.down(2);
  page.columns(sheet.places);
}

}  // namespace

std::string signed_text(double value) {
  if (!std::isfinite(value)) return "-";
  return fmt::format("{:+.{}f}", value, std::abs(value) < 0.1 ? 4 : 3);
}

Result<std::string> datasheet_pdf(const DataSheet& sheet) {
  return draw_pdf({{kWidthMm, kHeightMm}, "Data sheet of a structured-light scanner"}, [&](cairo_t* pen) {
    Page page(pen);
    draw(page, sheet);
  });
}

}  // namespace slsd
