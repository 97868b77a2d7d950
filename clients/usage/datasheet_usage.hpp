// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <string>

#include <CLI/CLI.hpp>

namespace slsd {

/// The options of `slsctl datasheet`.
struct DatasheetRequest {
  std::filesystem::path folder;                             ///< of the clouds, one for each place of an artefact
  int plate_places = 0, sphere_places = 0, bar_places = 0;  ///< to measure; 0: those in the folder
  double diameter_mm = 0, spacing_mm = 0;                   ///< as calibrated; 0: none
  double uncertainty_mm = 0;                                ///< expanded, k = 2, of both
  std::string note;                                         ///< for the sheet
  std::filesystem::path output;                             ///< the PDF; empty: datasheet.pdf in the folder
  std::filesystem::path ball_bar;                           ///< an STL to print instead
  std::filesystem::path socket;
  bool json = false;
};

/// Adds the options. slsctl checks them; slsd-datasheet, which it starts, carries them out.
void add_datasheet_options(CLI::App& command, DatasheetRequest& request);

/// The error in the options together; empty: none.
[[nodiscard]] std::string wrong_datasheet(const DatasheetRequest& request);

inline constexpr const char* kDatasheetProgram = "slsd-datasheet";
inline constexpr const char* kDatasheetPurpose =
    "measure the scanner's accuracy with a plate and spheres, and write a PDF";
inline constexpr const char* kDatasheetExamples =
    "  slsctl datasheet acceptance --plate 6\n"
    "  slsctl datasheet acceptance --sphere 10 --bar 7 --diameter-mm 40.012 --spacing-mm 200.034\n";

}  // namespace slsd
