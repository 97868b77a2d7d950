// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/datasheet/make_datasheet.hpp"

#include <chrono>
#include <cmath>
#include <iostream>
#include <map>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/datasheet/ball_bar.hpp"
#include "core/datasheet/measure_artefact.hpp"
#include "core/mesh/mesh_file.hpp"
#include "core/printable.hpp"
#include "core/utc_text.hpp"
#include "drivers/files/file.hpp"
#include "programs/datasheet/draw_datasheet.hpp"
#include "programs/datasheet/places.hpp"

namespace slsd {
namespace {

using nlohmann::json;
using std::filesystem::path;

constexpr std::size_t kNoteBytes = 200;

/// Figures of all clouds of the folder.
struct Figures {
  std::vector<PlateFigures> plates;
  std::vector<SphereFigures> spheres;
  std::vector<BarFigures> bars;
  std::vector<std::string> lines;  ///< one for each cloud
};

std::string line_of(const PlateFigures& plate) {
  return fmt::format(
      "{} points, {:.0f} mm long, {:.0f} mm away, tilted by {:.0f} degrees: range {:.4f} mm, RMS {:.4f} mm",
      plate.form.points, plate.long_side_mm, plate.distance_mm, plate.tilt_deg, plate.form.range_mm, plate.form.rms_mm);
}

std::string line_of(const SphereFigures& sphere) {
  return fmt::format("{} points, {:.0f} mm away: range {:.4f} mm, diameter {} mm", sphere.form.points,
                     sphere.sphere.centre_mm.norm(), sphere.form.range_mm, signed_text(sphere.size_error_mm));
}

std::string line_of(const BarFigures& bar) {
  return fmt::format("{:.0f} mm away: spacing {} mm", ((bar.first.centre_mm + bar.second.centre_mm) / 2).norm(),
                     signed_text(bar.spacing_error_mm));
}

/// Evaluates a cloud, and adds its figures.
Result<> add(Figures& figures, Artefact artefact, const std::string& name, std::span<const DensePoint> points,
             const DatasheetRequest& request) {
  const auto take = [&](auto measured, auto& all) -> Result<> {
    if (!measured) return fail(measured.error().code, measured.error().message, name);
    figures.lines.push_back(name + ": " + line_of(*measured));
    all.push_back(std::move(*measured));
    return {};
  };
  if (artefact == Artefact::kPlate) return take(measure_plate(points), figures.plates);
  if (request.diameter_mm == 0 || (artefact == Artefact::kBar && request.spacing_mm == 0)) {
    return fail(ErrorCode::kInvalidArgument, "needs the artefact's size: add --diameter-mm, and for a bar --spacing-mm",
                name);
  }
  if (artefact == Artefact::kSphere) return take(measure_sphere(points, request.diameter_mm), figures.spheres);
  return take(measure_bar(points, request.diameter_mm, request.spacing_mm), figures.bars);
}

const char* advice(Artefact artefact) {
  switch (artefact) {
    case Artefact::kPlate:
      return "put the flat plate at a new place in the measuring volume, with a new tilt";
    case Artefact::kSphere:
      return "put the sphere at a new place in the measuring volume";
    case Artefact::kBar:
      break;
  }
  return "put the bar at a new place in the measuring volume, in a new direction";
}

/// Scans until the artefact is measured, each time when the user presses Enter.
/// @errors kCancelled: the input ended
Result<> take_place(PlaceScanner& scanner, Artefact artefact, int number, int places, const DatasheetRequest& request,
                    Figures& figures) {
  const std::string name = cloud_name(artefact, number);
  for (;;) {
    std::cerr << fmt::format("{}, place {} of {}: {}, then press Enter. ", to_string(artefact), number, places,
                             advice(artefact))
              << std::flush;
    std::string line;
    if (!std::getline(std::cin, line)) {
      std::cerr << "\n";
      return fail(ErrorCode::kCancelled,
                  fmt::format("the input ended before {}: the same command continues from there", name));
    }
    const auto bytes = scanner.scan();
    if (!bytes) return tl::unexpected(bytes.error());
    const auto points = read_dense_ply(*bytes);
    if (!points) return tl::unexpected(points.error());
    const auto added = add(figures, artefact, name, *points, request);
    if (!added) {
      std::cerr << added.error().message << "\n";
      continue;
    }
    Result<> written = make_folder(request.folder);
    if (written) written = write_file_atomically(request.folder / name, *bytes);
    if (!written) return written;
    std::cerr << figures.lines.back() << "\n";
    return {};
  }
}

Result<> measure(Artefact artefact, int places, const DatasheetRequest& request, std::optional<PlaceScanner>& scanner,
                 Figures& figures) {
  const auto clouds = clouds_in(request.folder, artefact);
  if (!clouds) return tl::unexpected(clouds.error());
  for (const auto& [number, file] : *clouds) {
    const auto points = read_place(file);
    if (!points) return tl::unexpected(points.error());
    if (auto added = add(figures, artefact, file.filename().string(), *points, request); !added) return added;
  }
  for (int number = 1; number <= places; ++number) {
    if (clouds->contains(number)) continue;
    if (!scanner) {
      auto opened = PlaceScanner::open(request.socket);
      if (!opened) return tl::unexpected(opened.error());
      scanner.emplace(std::move(*opened));
    }
    if (auto taken = take_place(*scanner, artefact, number, places, request, figures); !taken) return taken;
  }
  return {};
}

template <class Measured, class ValueOf>
std::vector<double> values_of(const std::vector<Measured>& all, const ValueOf& value_of) {
  std::vector<double> values;
  for (const Measured& each : all) values.push_back(value_of(each));
  return values;
}

std::vector<Quantity> quantities_of(const Figures& figures, double uncertainty_mm) {
  std::vector<Quantity> all;
  const auto add = [&](const char* name, const char* source, const char* unit, std::vector<double> values,
                       double artefact_mm) {
    if (values.empty()) return;
    const Summary summary = summarise_places(values, artefact_mm);
    all.push_back({name, source, unit, std::move(values), summary});
  };
  const auto range = [](const auto& each) { return each.form.range_mm; };
  const auto range_95 = [](const auto& each) { return each.form.range_95_mm; };
  const auto over_sigma = [](const auto& each) { return each.form.error_over_sigma; };
  add("Flatness", "VDI/VDE 2634-2, flatness error", "mm", values_of(figures.plates, range), 0);
  add("Flatness, 95 % of points", "ISO 10360-13, 95 % dispersion", "mm", values_of(figures.plates, range_95), 0);
  add("Plate: error over sigma", "slsd's stated sigma; ideal: 1", "", values_of(figures.plates, over_sigma), 0);
  add("Probing error, form", "VDI/VDE 2634-2, PF", "mm", values_of(figures.spheres, range), 0);
  add("Form, 95 % of points", "ISO 10360-13, 95 % dispersion", "mm", values_of(figures.spheres, range_95), 0);
  add("Probing error, size", "VDI/VDE 2634-2, PS", "mm",
      values_of(figures.spheres, [](const SphereFigures& each) { return each.size_error_mm; }), uncertainty_mm);
  add("Sphere: error over sigma", "slsd's stated sigma; ideal: 1", "", values_of(figures.spheres, over_sigma), 0);
  add("Sphere spacing error", "VDI/VDE 2634-2, SD", "mm",
      values_of(figures.bars, [](const BarFigures& each) { return each.spacing_error_mm; }), uncertainty_mm);
  return all;
}

DataSheet sheet_of(const DatasheetRequest& request, Figures figures) {
  DataSheet sheet;
  sheet.quantities = quantities_of(figures, request.uncertainty_mm);
  sheet.facts.push_back("slsd " SLSD_VERSION ", evaluated " + utc_text(std::chrono::system_clock::now()));
  if (!request.note.empty()) sheet.facts.push_back(printable(request.note, kNoteBytes));
  std::string artefacts;
  if (request.diameter_mm > 0) artefacts += fmt::format("Spheres of {} mm", request.diameter_mm);
  if (request.spacing_mm > 0) artefacts += fmt::format(", {} mm apart", request.spacing_mm);
  if (!artefacts.empty())
    sheet.facts.push_back(artefacts + fmt::format("; uncertainty (k = 2) {} mm, as given", request.uncertainty_mm));
  sheet.facts.push_back(
      "The farthest 0.3 % of points are left out. Of each sphere, the cap within 60 degrees of its top counts.");
  if (figures.plates.size() < 6 || figures.spheres.size() < 10 || figures.bars.size() < 7)
    sheet.facts.push_back(
        "Not an acceptance test: the guideline requires 6 places of a plate, 10 of a sphere, 7 of a bar.");
  sheet.places = std::move(figures.lines);
  return sheet;
}

json json_of(const DataSheet& sheet, const path& file) {
  const auto number = [](double value) { return std::isfinite(value) ? json(value) : json(); };
  json quantities = json::array();
  for (const Quantity& quantity : sheet.quantities) {
    quantities.push_back({{"name", quantity.name},
                          {"source", quantity.source},
                          {"unit", quantity.unit},
                          {"values", quantity.values},
                          {"worst", number(quantity.summary.worst)},
                          {"mean", number(quantity.summary.mean)},
                          {"low", number(quantity.summary.low)},
                          {"high", number(quantity.summary.high)}});
  }
  return {{"quantities", quantities}, {"places", sheet.places}, {"sheet", file.string()}};
}

void print(const DataSheet& sheet, const path& file) {
  for (const std::string& line : sheet.places) std::cout << line << "\n";
  for (const Quantity& quantity : sheet.quantities) {
    const Summary& summary = quantity.summary;
    std::cout << fmt::format("{:<26} {:>2} places  worst {} {}  mean {} ({} to {})\n", quantity.name, summary.places,
                             signed_text(summary.worst), quantity.unit, signed_text(summary.mean),
                             signed_text(summary.low), signed_text(summary.high));
  }
  std::cout << file.string() << "\n";
}

Result<> write_ball_bar(const DatasheetRequest& request) {
  const auto bytes = write_mesh(ball_bar(request.diameter_mm, request.spacing_mm), MeshFormat::kStl, "ball bar");
  if (!bytes) return tl::unexpected(bytes.error());
  return write_file_atomically(request.ball_bar, *bytes);
}

}  // namespace

Result<> make_datasheet(const DatasheetRequest& request) {
  if (!request.ball_bar.empty()) return write_ball_bar(request);
  Figures figures;
  std::optional<PlaceScanner> scanner;
  for (const auto& [artefact, places] :
       {std::pair(Artefact::kPlate, request.plate_places), std::pair(Artefact::kSphere, request.sphere_places),
        std::pair(Artefact::kBar, request.bar_places)}) {
    if (auto measured = measure(artefact, places, request, scanner, figures); !measured) return measured;
  }
  if (figures.lines.empty()) {
    return fail(ErrorCode::kNotFound,
                "has no plate-01.ply, sphere-01.ply or bar-01.ply: measure with --plate N, --sphere N or --bar N",
                request.folder.string());
  }
  const DataSheet sheet = sheet_of(request, std::move(figures));
  const auto pdf = datasheet_pdf(sheet);
  if (!pdf) return tl::unexpected(pdf.error());
  const path file = request.output.empty() ? request.folder / "datasheet.pdf" : request.output;
  if (auto written = write_file_atomically(file, *pdf); !written) return written;
  request.json ? void(std::cout << json_of(sheet, file).dump() << "\n") : print(sheet, file);
  return {};
}

}  // namespace slsd
