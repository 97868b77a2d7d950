// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/command_line.hpp"

#include <iostream>

#include <CLI/CLI.hpp>

#include "clients/usage/usage.hpp"
#include "daemon/configuration/configuration.hpp"

namespace slsd {
namespace {

void add_calibration_options(CLI::App& app, CommandLine& line) {
  CalibrateRequest& request = line.request;
  auto* calibrate = app.get_option("--calibrate");
  auto* latency =
      app.add_flag("--latency", line.latency, "with --calibrate: measure the delay from the projector to each camera");
  latency->needs(calibrate);
  app.add_option("--output", request.output, "with --calibrate: the calibration file to write")->needs(calibrate);
  app.add_option("--from", request.from, "read captures from this folder instead of using hardware")->excludes(latency);
  app.add_option(
         "--board", request.board,
         "charuco:COLSxROWS:SQUARE_MM:MARKER_MM:DICTIONARY (squares), chessboard:COLSxROWS:SQUARE_MM (inner corners), "
         "circles:COLSxROWS:SPACING_MM:DIAMETER_MM, plane:COLSxROWS:PITCH_MM:MARKER_MM:DICTIONARY")
      ->excludes(latency);
  app.add_option("--ruler", request.ruler, "NOMINAL:MEASURED, in mm: the printed ruler's nominal and measured length")
      ->excludes(latency);
  app.add_option("--plane", request.plane,
                 "with --calibrate: the reference plane for the second step, such as plane:8x5:100:40:DICT_4X4_50")
      ->needs(calibrate)
      ->excludes(latency);
  app.add_option("--plane-ruler", request.plane_ruler, "like --ruler, for the print of the reference plane")
      ->needs("--plane");
  app.add_option("--planes", request.planes, "with --plane: how many views of the plane to take")
      ->check(between(1, 99))
      ->needs("--plane");
  app.add_option("--use", request.use, "with --calibrate --from: use only the poses FIRST:LAST")
      ->needs(calibrate)
      ->needs("--from");
  app.add_flag("--force", request.force, "with --calibrate: replace the calibration in force even if the scale differs")
      ->needs(calibrate);
  const auto choose_code = [&request](const std::string& code) { request.gray_code = code == "gray"; };
  app.add_option_function<std::string>(
         "--code", choose_code,
         "with --calibrate: project the pattern, or a Gray code, which takes many pictures per pose")
      ->check(one_of({"pattern", "gray"}))
      ->needs(calibrate);
  app.add_option("--poses", request.poses, "with --calibrate: how many poses to take")
      ->check(between(3, 99))
      ->needs(calibrate);
  app.add_option("--record", request.record,
                 "with --calibrate: the folder for the captures; poses already in it are reused")
      ->needs(calibrate);
  app.add_option("--socket", request.socket, "with --calibrate: use the devices of the service at this socket")
      ->needs(calibrate)
      ->excludes(latency)
      ->excludes("--from");
  app.add_flag("--progress", request.progress, "with --calibrate: also print progress as JSON, one object per line")
      ->needs(calibrate);
}

CLI::Option* add_print_options(CLI::App& app, PrintRequest& request) {
  auto* print = app.add_option("--print-board", request.file, "write a calibration board: .pdf, .svg or .png");
  app.add_option("--paper", request.paper, "the paper to print on; WIDTHxHEIGHT is in mm")
      ->type_name("{A0,A1,A2,A3,A4,letter} or WIDTHxHEIGHT")
      ->needs(print);
  app.add_option("--dpi", request.dpi, "with --print-board FILE.png: the resolution")->needs(print);
  return print;
}

void add_extrinsics_options(CLI::App& app, ExtrinsicsRequest& request) {
  auto* extrinsics = app.add_option("--extrinsics", request.file,
                                    "measure the poses of several scanners with a board, and write them to this file");
  app.add_option("--scanner", request.scanners, "with --extrinsics: NAME=SOCKET; the first defines the common frame")
      ->needs(extrinsics);
  app.add_option("--parent", request.parent, "with --extrinsics: the name of that frame (cell)")->needs(extrinsics);
  app.add_option("--places", request.places, "with --extrinsics: how many places of the board to measure (3)")
      ->check(between(1, 99))
      ->needs(extrinsics);
  for (const char* other : {"--calibrate", "--verify", "--correct", "--pattern", "--check", "--check-config", "--list"})
    extrinsics->excludes(app.get_option(other));
}

void add_options(CLI::App& app, CommandLine& line) {
  app.set_version_flag("--version", "slsd " SLSD_VERSION);
  app.add_option("--config", line.configuration, "configuration file; default: " + std::string(kConfigurationFile));
  app.add_option("--log-level", line.level, "lowest level to log")
      ->check(one_of({"trace", "debug", "info", "warning", "error", "critical"}));
  auto* pattern = app.add_option("--pattern", line.pattern_image, "write the image that the projector shows, as a PNG");
  auto* check = app.add_flag("--check", line.check, "check everything that a scan needs, and print remedies");
  auto* check_configuration = app.add_flag("--check-config", line.check_configuration,
                                           "check only the configuration, without devices or the service");
  auto* replay = app.add_option("--replay", line.bundle,
                                "decode the scans of a bundle (slsctl bundle) again, and compare the clouds");
  app.add_option("--unpack", line.folder, "with --replay: a new folder for the bundle's files and the clouds")
      ->needs(replay);
  auto* list = app.add_flag("--list", line.list, "list the cameras and projectors that slsd finds");
  app.add_flag("--json", line.as_json, "print the list as JSON")->needs(list);
  auto* calibrate = app.add_flag("--calibrate", line.calibrate, "calibrate the scanner");
  auto* verify =
      app.add_flag("--verify", line.verify, "check the calibration in force by measuring a board or a plane");
  auto* correct = app.add_flag("--correct", line.request.correct,
                               "repair the calibration in force from one view of a board, if it drifted");
  auto* undo = app.add_flag("--undo", line.undo, "with --correct: restore the calibration from before the corrections")
                   ->needs(correct);
  add_calibration_options(app, line);
  undo->excludes("--from")->excludes("--board");
  for (auto* other : {calibrate, verify, pattern, check, check_configuration, list}) correct->excludes(other);
  calibrate->excludes(verify)->excludes(pattern)->excludes(check)->excludes(list);
  verify->excludes(pattern)->excludes(check)->excludes(list);
  pattern->excludes(check)->excludes(list);
  check->excludes(list);
  check_configuration->excludes(calibrate)->excludes(verify)->excludes(pattern)->excludes(check)->excludes(list);
  add_extrinsics_options(app, line.extrinsics);
  replay->excludes(calibrate)->excludes(verify)->excludes(correct)->excludes(pattern)->excludes(check)->excludes(
      check_configuration);
  replay->excludes(list)->excludes(app.get_option("--extrinsics"));
  add_print_options(app, line.print)
      ->excludes(replay)
      ->excludes(pattern)
      ->excludes(calibrate)
      ->excludes(verify)
      ->excludes(correct)
      ->excludes(check)
      ->excludes(check_configuration)
      ->excludes(list)
      ->excludes("--extrinsics");
}

/// --from, --board and --ruler belong to several commands.
void check_commands(const CLI::App& app, const CommandLine& line) {
  const bool measures = line.verify || line.request.correct;
  if (measures && app.count("--ruler") > 0 && app.count("--board") == 0) {
    throw CLI::RequiresError(line.verify ? "--ruler with --verify" : "--ruler with --correct", "--board");
  }
  if (line.calibrate || measures) return;
  const bool extrinsics = !line.extrinsics.file.empty();
  for (const char* option : {"--from", "--ruler"}) {
    if (app.count(option) > 0 && !(extrinsics && option == std::string_view("--ruler")))
      throw CLI::RequiresError(option, "--calibrate, --verify or --correct");
  }
  if (app.count("--board") > 0 && line.print.file.empty() && !extrinsics) {
    throw CLI::RequiresError("--board", "--calibrate, --verify, --correct, --extrinsics or --print-board");
  }
}

}  // namespace

tl::expected<CommandLine, int> parse_command_line(int argc, char** argv) {
  CLI::App app("The service of a single-shot structured-light scanner. Without options it runs in the foreground.",
               "slsd");
  CommandLine line;
  add_options(app, line);
  const auto ended = parse_usage(app, argc, argv, [&] { check_commands(app, line); });
  if (ended) return tl::unexpected(*ended);
  line.request.configuration_file = line.configuration;
  line.print.board = line.request.board;
  return line;
}

int exit_status(const Result<>& result) {
  if (!result) std::cerr << "slsd: " << to_string(result.error()) << "\n";
  return result ? kDone : kFailed;
}

}  // namespace slsd
