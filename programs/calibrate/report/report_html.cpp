// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/report/report_html.hpp"

#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "core/calibrate/judge/grade.hpp"
#include "programs/calibrate/report/image_figures.hpp"
#include "programs/calibrate/report/rig_figures.hpp"
#include "programs/calibrate/report/svg_figure.hpp"

namespace slsd {
namespace {

constexpr std::string_view kStyle = R"(
body { font: 15px/1.45 sans-serif; color: #222; background: #fff; max-width: 980px; margin: 24px auto; padding: 0 12px }
h1 { font-size: 22px } h2 { font-size: 17px; margin-top: 32px }
table { border-collapse: collapse; font-variant-numeric: tabular-nums }
td, th { padding: 2px 10px; border-bottom: 1px solid #ddd; text-align: right; white-space: nowrap }
td:first-child, th:first-child, td.words { text-align: left }
th, td.words { white-space: normal } .why { max-width: min(680px, calc(100vw - 140px)) }
tr.out td { color: #b00 }
figure { display: inline-block; margin: 0 8px 12px 0; width: min(460px, 100%); vertical-align: top }
figcaption { font-size: 13px; color: #555 }
svg { font: 11px sans-serif; max-width: 100%; height: auto } svg path { fill: none }
.wide { overflow-x: auto } .aside { color: #777 }
.grade { display: inline-block; padding: 2px 14px; border-radius: 4px; color: #fff; font-weight: bold }
.good { background: #2a7d2e } .usable { background: #b06f00 } .bad { background: #b3261e }
@media print {
  body { margin: 0; max-width: none } figure { width: 47% } figure, tr, .grade { break-inside: avoid } h2 { break-after: avoid }
  .grade { -webkit-print-color-adjust: exact; print-color-adjust: exact }
}
)";

/// A table with its own scroll bar if the page is narrower.
std::string table_of(const std::string& rows) {
  return "<div class='wide'><table>\n" + rows + "</table></div>\n";
}

std::string list_of(const std::vector<std::string>& lines) {
  std::string items;
  for (const std::string& line : lines) items += "<li>" + escaped(line) + "</li>\n";
  return items.empty() ? items : "<ul>\n" + items + "</ul>\n";
}

std::string refusal_of(const std::string& why) {
  return "<p><span class='grade bad'>not put in force</span></p>\n<p>" + escaped(why) + "</p>\n";
}

std::string verdict_of(const CalibrationOutcome& outcome, const std::string& refused) {
  const auto grade = to_string(outcome.verdict.grade);
  std::string html = refused.empty() ? "" : refusal_of(refused);
  html += fmt::format("<p><span class='grade {0}'>{0}</span></p>\n", grade);
  html += list_of(outcome.verdict.reasons);
  if (!outcome.warnings.empty()) html += "<h2>Warnings</h2>\n" + list_of(outcome.warnings);
  if (!outcome.verdict.advice.empty()) html += "<h2>Poses to take next</h2>\n" + list_of(outcome.verdict.advice);
  return html;
}

std::string error_row(std::string_view what, double px, std::optional<double> good) {
  return fmt::format("<tr><td class='words'>{}</td><td>{:.3f} px</td><td class='aside'>{}</td></tr>\n", what, px,
                     good ? fmt::format("up to {:.1f} px", *good) : "");
}

std::string errors_of(const CalibrationOutcome& outcome) {
  return "<h2>Errors, root mean square</h2>\n" +
         table_of("<tr><th></th><th>here</th><th>good</th></tr>\n" +
                  error_row("corners, in the cameras", outcome.camera_rms_px, {}) +
                  error_row("symbols, in the projector", outcome.projector_rms_px, {}) +
                  error_row("symbols, in the cameras", outcome.symbol_rms_px, {}) +
                  error_row("symbols off their epipolar lines, in the projector", outcome.epipolar_rms_px,
                            kEpipolarPx.good) +
                  error_row("corners of each pose, calibrated from the others", outcome.held_out_corner_px,
                            kHeldOutPx.good) +
                  error_row("symbols of each pose, calibrated from the others", outcome.held_out_symbol_px,
                            kHeldOutPx.good));
}

std::string plane_cells(const std::optional<ViewCheck>& check) {
  if (!check) return "<td colspan='4'>not measured</td>";
  const std::string distances = check->trueness
                                    ? fmt::format("<td>{:+.3f}</td><td>{:.3f}</td>", check->trueness->scale_percent,
                                                  check->trueness->long_rms_percent)
                                    : "<td></td><td></td>";
  return fmt::format("<td>{:.3f}</td><td>{:.3f}</td>", check->plane_rms_mm, check->plane_sigma_mm) + distances;
}

/// The results of the views of the reference plane, before and after they took part.
std::string planes_of(const CalibrationOutcome& outcome) {
  if (outcome.planes.empty()) return {};
  std::string html =
      "<h2>Reference plane</h2>\n<p>Before and after the second step, which uses the plane. Off: symbols off the "
      "plane, in mm; noise: what their noise explains. Distances between markers, in per cent: scale, and long "
      "distances.</p>\n<div class='wide'><table>\n<tr><th>view</th><th colspan='4'>before</th><th "
      "colspan='4'>after</th></tr>\n<tr><th></th>";
  for (int i = 0; i < 2; ++i) html += "<th>off</th><th>noise</th><th>scale</th><th>long</th>";
  html += "</tr>\n";
  for (const PlaneCheck& plane : outcome.planes) {
    html += fmt::format("<tr><td>{} {}</td>{}{}</tr>\n", escaped(plane.name), escaped(plane.camera),
                        plane_cells(plane.before), plane_cells(plane.after));
  }
  return html + "</table></div>\n";
}

std::string image_figures(const CalibrationOutcome& outcome) {
  std::string coverage;
  std::string residuals;
  for (std::size_t i = 0; i < outcome.observations.cameras.size(); ++i) {
    coverage += camera_coverage_figure(outcome, i);
    residuals += camera_residual_figure(outcome, i);
  }
  return "<h2>Coverage</h2>\n" + coverage + projector_coverage_figure(outcome) +
         "<h2>Residuals</h2>\n<p>The error of each point. Arrows should point in random directions: if neighbours "
         "agree, the lens model does not fit.</p>\n" +
         residuals + projector_residual_figure(outcome);
}

std::string rig_figures(const CalibrationOutcome& outcome) {
  std::string html = "<h2>Poses in space</h2>\n" + poses_from_above(outcome) + poses_from_the_right(outcome);
  html += "<h2>The board</h2>\n<p>" + escaped(board_text(outcome.board)) + "</p>\n" + board_figure(outcome);
  const std::string depth = depth_figure(outcome);
  return depth.empty() ? html
                       : html +
                             fmt::format("<h2>Uncertainty of depth</h2>\n<p>Good up to {:.1f} % of the distance.</p>\n",
                                         100 * kDepthShare.good) +
                             depth;
}

/// A row's text across all columns except the first; a narrow screen shows it whole.
std::string words_of(const std::string& words) {
  return "<td class='words' colspan='7'><div class='why'>" + escaped(words) + "</div></td></tr>\n";
}

std::string used_row(const PoseReport& pose, std::size_t index) {
  const std::size_t off = pose.outlying_corners + pose.outlying_symbols;
  std::string rows = fmt::format(
      "<tr><td><span style='color:{}'>&#9632;</span> {}</td><td>{}</td><td>{:.3f}</td><td>{:.3f}</td><td>{}</td>"
      "<td>{:.3f}</td><td>{:.3f}</td><td>{}</td></tr>\n",
      pose_colour(index), escaped(pose.name), pose.corners, pose.corner_rms_px, pose.held_out.corner_rms_px,
      pose.symbols, pose.symbol_rms_px, pose.held_out.symbol_rms_px, off > 0 ? std::to_string(off) : "");
  for (const std::string& remark : pose.remarks) rows += "<tr><td></td>" + words_of(remark);
  for (const std::string& view : pose.without) rows += "<tr><td></td>" + words_of("without " + view);
  return rows;
}

std::string poses_of(const CalibrationOutcome& outcome) {
  std::string html =
      "<tr><th>pose</th><th>corners</th><th>px</th><th>held out, px</th><th>symbols</th><th>px</th><th>held out, "
      "px</th><th>outliers</th></tr>\n";
  std::size_t used = 0;
  for (const PoseReport& pose : outcome.poses) {
    html += pose.fault ? "<tr class='out'><td>" + escaped(pose.name) + "</td>" + words_of("left out: " + pose.reason)
                       : used_row(pose, used++);
  }
  return fmt::format(
             "<h2>Poses</h2>\n<p>{} were used; {} are good. Errors are root mean square, in the camera. Held out: "
             "calibrated from the other poses. Outliers disagree with all other points, and were left out.</p>\n",
             used, kPosesGood) +
         table_of(html);
}

/// The unit of a parameter by its name: "fx" and "cy" are pixels, "k1" and "p1" have none, turns are radians, positions
/// mm.
std::string_view unit_of(std::string_view parameter) {
  if (parameter.starts_with("f") || parameter.starts_with("c")) return "px";
  if (parameter.starts_with("turn")) return "rad";
  return parameter.starts_with("place") ? "mm" : "";
}

std::string parameters_of(const CalibrationOutcome& outcome) {
  std::string html =
      "<tr><th>device</th><th>parameter</th><th>value</th><th>one standard deviation</th><th></th></tr>\n";
  for (const ParameterReport& parameter : outcome.parameters) {
    html += fmt::format("<tr><td>{}</td><td>{}</td><td>{:.5f}</td><td>{:.5f}</td><td class='words'>{}</td></tr>\n",
                        escaped(parameter.device), escaped(parameter.name), parameter.value, parameter.sigma,
                        unit_of(parameter.name));
  }
  return "<h2>Parameters</h2>\n" + table_of(html);
}

/// The head of the report: date, board, devices, program.
std::string head_of(const CalibrationOutcome& outcome) {
  const CalibrationReport& report = outcome.calibration.report;
  const auto device = [](std::string_view name, int width_px, int height_px) {
    return fmt::format("{}, {} x {} px; ", escaped(name), width_px, height_px);
  };
  std::string devices;
  for (const CalibratedCamera& camera : outcome.calibration.cameras)
    devices += device(camera_text(outcome, camera.name), camera.lens.width_px, camera.lens.height_px);
  const Lens& projector = outcome.calibration.projector;
  devices += device("projector", projector.width_px, projector.height_px);
  return fmt::format("<p>{}<br>board {}<br>{}slsd {}</p>\n", escaped(report.date.value_or("")),
                     escaped(report.board.value_or("not named")), devices, SLSD_VERSION);
}

std::string page(const std::string& body) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'><meta name='viewport' "
      "content='width=device-width, initial-scale=1'><title>Calibration</title><style>{}</style></head>"
      "<body>\n<h1>Calibration</h1>\n{}</body></html>\n",
      kStyle, body);
}

}  // namespace

std::string report_html(const CalibrationOutcome& outcome, const std::string& refused) {
  return page(head_of(outcome) + verdict_of(outcome, refused) + errors_of(outcome) + planes_of(outcome) +
              image_figures(outcome) + rig_figures(outcome) + poses_of(outcome) + parameters_of(outcome));
}

std::string refusal_html(const std::string& why, const std::vector<PoseReport>& poses) {
  std::string rows;
  for (const PoseReport& pose : poses) {
    if (pose.fault)
      rows += "<tr class='out'><td>" + escaped(pose.name) + "</td>" + words_of("left out: " + pose.reason);
  }
  return page(refusal_of(why) + (rows.empty() ? rows : "<h2>Poses</h2>\n" + table_of(rows)));
}

}  // namespace slsd
