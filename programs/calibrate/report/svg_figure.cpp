// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/report/svg_figure.hpp"

#include <fmt/format.h>

namespace slsd {

std::string escaped(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

std::string pose_colour(std::size_t pose) {
  return fmt::format("hsl({},70%,42%)", pose * 137 % 360);
}

SvgFigure::SvgFigure(const Eigen::Vector2d& first, const Eigen::Vector2d& last, double width_px)
    : first_(first), last_(last), scale_(width_px / (last.x() - first.x())) {}

void SvgFigure::line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, std::string_view colour, double width_px) {
  const Eigen::Vector2d a = place(from);
  const Eigen::Vector2d b = place(to);
  shapes_ += fmt::format("<path d='M{:.1f} {:.1f}L{:.1f} {:.1f}' stroke='{}' stroke-width='{}'/>\n", a.x(), a.y(),
                         b.x(), b.y(), colour, width_px);
}

void SvgFigure::dot(const Eigen::Vector2d& at, double radius_px, std::string_view colour) {
  const Eigen::Vector2d centre = place(at);
  shapes_ +=
      fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='{}' fill='{}'/>\n", centre.x(), centre.y(), radius_px, colour);
}

void SvgFigure::rectangle(const Eigen::Vector2d& first, const Eigen::Vector2d& last, std::string_view fill) {
  const Eigen::Vector2d a = place(first);
  const Eigen::Vector2d size = place(last) - a;
  shapes_ += fmt::format("<rect x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}' fill='{}'/>\n", a.x(), a.y(),
                         size.x(), size.y(), fill);
}

void SvgFigure::frame() {
  const Eigen::Vector2d size = place(last_);
  shapes_ += fmt::format("<rect x='0.5' y='0.5' width='{:.1f}' height='{:.1f}' fill='none' stroke='#888'/>\n",
                         size.x() - 1, size.y() - 1);
}

void SvgFigure::text(const Eigen::Vector2d& at, std::string_view words, std::string_view anchor) {
  const Eigen::Vector2d corner = place(at);
  shapes_ += fmt::format("<text x='{:.1f}' y='{:.1f}' text-anchor='{}'>{}</text>\n", corner.x(), corner.y(), anchor,
                         escaped(words));
}

std::string SvgFigure::str(std::string_view caption) const {
  const Eigen::Vector2d size = place(last_);
  return fmt::format(
      "<figure><svg xmlns='http://www.w3.org/2000/svg' width='{0:.0f}' height='{1:.0f}' viewBox='0 0 {0:.0f} "
      "{1:.0f}'>\n"
      "{2}</svg><figcaption>{3}</figcaption></figure>\n",
      size.x(), size.y(), shapes_, escaped(caption));
}

}  // namespace slsd
