// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/usage/datasheet_usage.hpp"

#include "clients/usage/usage.hpp"

namespace slsd {

void add_datasheet_options(CLI::App& command, DatasheetRequest& request) {
  command.add_option("FOLDER", request.folder, "the clouds: plate-01.ply, sphere-01.ply, bar-01.ply and so on")
      ->type_name("FOLDER");
  const auto add_places = [&](const char* name, int& places, const char* text) {
    command.add_option(name, places, text)->check(between(1, 99))->type_name("N");
  };
  add_places("--plate", request.plate_places, "measure a flat plate at N places; 6 are usual");
  add_places("--sphere", request.sphere_places, "measure a sphere at N places; 10 are usual");
  add_places("--bar", request.bar_places, "measure a bar with two spheres at N places; 7 are usual");
  command.add_option("--diameter-mm", request.diameter_mm, "the spheres' diameter, from their certificate")
      ->check(between(1, 2000))
      ->type_name("MM");
  command
      .add_option("--spacing-mm", request.spacing_mm, "the distance between the bar's spheres, from its certificate")
      ->check(between(2, 20000))
      ->type_name("MM");
  command
      .add_option("--uncertainty-mm", request.uncertainty_mm,
                  "the certificate's expanded uncertainty (k = 2) of these lengths (0)")
      ->check(between(0, 10))
      ->type_name("MM");
  command.add_option("--note", request.note, "a line for the sheet, such as the operator and the temperature")
      ->type_name("TEXT");
  command.add_option("-o,--output", request.output, "the sheet (datasheet.pdf in that folder)")->type_name("FILE.pdf");
  command.add_option("--ball-bar", request.ball_bar, "write a bar with two spheres to print, and measure nothing")
      ->type_name("FILE.stl");
}

std::string wrong_datasheet(const DatasheetRequest& request) {
  const bool prints = !request.ball_bar.empty();
  if (!prints && request.folder.empty()) return "FOLDER is missing";
  if (prints && !request.folder.empty()) return "--ball-bar takes no FOLDER";
  if ((prints || request.sphere_places > 0 || request.bar_places > 0) && request.diameter_mm == 0)
    return "--diameter-mm is missing: the spheres' diameter";
  if ((prints || request.bar_places > 0) && request.spacing_mm == 0)
    return "--spacing-mm is missing: the distance between the centres of the bar's spheres";
  if (request.spacing_mm > 0 && request.spacing_mm <= request.diameter_mm)
    return "--spacing-mm must be more than --diameter-mm";
  return {};
}

}  // namespace slsd
