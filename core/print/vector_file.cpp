// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/print/vector_file.hpp"

#include <cairo-pdf.h>
#include <cairo-svg.h>

#include <memory>

namespace slsd {
namespace {

constexpr double kPointsToMm = 72 / 25.4;

using VectorSurface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using Pen = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

cairo_status_t append(void* bytes, const unsigned char* from, unsigned count) {
  static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(from), count);
  return CAIRO_STATUS_SUCCESS;
}

tl::unexpected<Error> refuse(cairo_status_t status) {
  return fail(ErrorCode::kIo, std::string("cannot draw the sheet: ") + cairo_status_to_string(status));
}

// A file's last bytes come when its surface is finished.
Result<std::string> draw_file(cairo_surface_t* surface, double scale, const DrawPage& draw, const std::string& bytes) {
  const auto drawn = draw_on(surface, scale, draw);
  if (!drawn) return tl::unexpected(drawn.error());
  cairo_surface_finish(surface);
  if (const auto status = cairo_surface_status(surface)) return refuse(status);
  return bytes;
}

}  // namespace

Result<> draw_on(cairo_surface_t* surface, double scale, const DrawPage& draw) {
  const Pen pen(cairo_create(surface), cairo_destroy);
  cairo_scale(pen.get(), scale, scale);
  draw(pen.get());
  if (const auto status = cairo_status(pen.get())) return refuse(status);
  return {};
}

Result<std::string> draw_pdf(const PdfPage& page, const DrawPage& draw) {
  std::string bytes;
  const VectorSurface surface(cairo_pdf_surface_create_for_stream(append, &bytes, page.size_mm.x() * kPointsToMm,
                                                                  page.size_mm.y() * kPointsToMm),
                              cairo_surface_destroy);
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE, page.title.c_str());
  return draw_file(surface.get(), kPointsToMm, draw, bytes);
}

Result<std::string> draw_svg(const Eigen::Vector2d& size_mm, const DrawPage& draw) {
  std::string bytes;
  const VectorSurface surface(cairo_svg_surface_create_for_stream(append, &bytes, size_mm.x(), size_mm.y()),
                              cairo_surface_destroy);
  cairo_svg_surface_set_document_unit(surface.get(), CAIRO_SVG_UNIT_MM);
  return draw_file(surface.get(), 1, draw, bytes);
}

}  // namespace slsd
