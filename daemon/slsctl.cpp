// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <string>

#include <CLI/CLI.hpp>

#include "core/shown_picture.hpp"
#include "daemon/client/client_commands.hpp"
#include "daemon/client/client_options.hpp"
#include "daemon/options_as_values.hpp"

namespace {

using slsd::ClientOptions;

const CLI::Validator kCloudFile(
    [](const std::string& file) {
      const auto extension = std::filesystem::path(file).extension();
      for (const char* known : {".ply", ".pcd", ".tiff", ".tif"})
        if (extension == known) return "";
      return "a cloud's file ends in .ply or .pcd, a depth map's in .tiff";
    },
    "CLOUD.ply|CLOUD.pcd|DEPTH.tiff");

void add_density(CLI::App* command, ClientOptions& options) {
  command->add_option("--density", options.density, "a point for each symbol, or for each camera pixel")
      ->check(CLI::IsMember({"symbols", "pixels"}));
}

void add_timeout(CLI::App* command, ClientOptions& options) {
  command->add_option("--timeout-ms", options.timeout_ms, "how long to wait for devices and frames")
      ->check(CLI::Range(1, 600'000));
}

void add_scan(CLI::App& app, ClientOptions& options) {
  CLI::App* scan = app.add_subcommand("scan", "trigger one scan, wait, write the cloud");
  scan->add_option("-o,--output,CLOUD", options.output, "write the cloud, as PLY or PCD, or as a depth map")
      ->check(kCloudFile);
  scan->add_option("--picture", options.picture, "write the frame with what was decoded, as a PNG");
  scan->add_option("--cloud-picture", options.cloud_picture, "write a picture of the cloud, as a PNG");
  add_density(scan, options);
  scan->add_flag("--normals", options.normals, "with --density pixels: the surface's normals too");
  scan->add_flag("--texture", options.texture, "also light the scene in white: intensities are those of the points");
  scan->add_flag("--ambient", options.ambient, "also take a frame without light, and subtract the light of the room");
  add_timeout(scan, options);
}

void add_watch(CLI::App& app, ClientOptions& options) {
  CLI::App* watch = app.add_subcommand("watch", "a line for each cloud as it comes");
  watch->add_option("--count", options.count, "end after so many clouds")->check(CLI::Range(1, 1'000'000'000));
  add_density(watch, options);
  watch->add_option("--rate", options.rate_hz, "at most so many a second")->check(CLI::Range(0.001, 1000.0));
}

void add_exposure(CLI::App& app, ClientOptions& options) {
  CLI::App* exposure =
      app.add_subcommand("exposure", "look at the scene, propose exposure and gain, say what else is wrong");
  exposure->add_option("--camera", options.camera, "the camera's name; without it the first");
  exposure->add_option("--exposure-max-us", options.exposure_max_us, "the longest exposure to propose (100000)")
      ->check(CLI::Range(1.0, 1e7));
  exposure->add_option("--gain-max-db", options.gain_max_db, "the highest gain to propose (24)")
      ->check(CLI::Range(0.0, 60.0));
  add_timeout(exposure, options);
}

void add_record(CLI::App& app, ClientOptions& options) {
  CLI::App* record = app.add_subcommand("record", "scan on and on, and write the frames, to be replayed");
  record->add_option("DIR", options.folder, "a folder that is not there yet, or empty")->required();
  record->add_option("--frames", options.count, "end after so many scans")->check(CLI::Range(1, 1'000'000'000));
  record->add_option("--seconds", options.seconds, "end after so long")->check(CLI::Range(0.001, 1e9));
  record->add_flag("--clouds", options.clouds, "write the clouds too");
  add_timeout(record, options);
}

const CLI::Validator kPicture(
    [](const std::string& picture) {
      const bool named = picture != "image" && picture != "held" && slsd::picture_named(picture);
      return named || std::filesystem::path(picture).extension() == ".png" ? ""
                                                                           : "no such picture; a file ends in .png";
    },
    "pattern|idle|white|black|focus|grid|FILE.png");

void add_calibrate(CLI::App& app, ClientOptions& options) {
  CLI::App* calibrate = app.add_subcommand(
      "calibrate",
      "calibrate with the service's devices, and put the result in force; Ctrl-C ends it with the poses there are");
  calibrate->add_option("ACTION", options.action, "begin one and follow it; look at, end or cancel the one under way")
      ->check(CLI::IsMember({"begin", "look", "end", "cancel"}));
  calibrate->add_option("--board", options.board, "the board, such as charuco:11x7:25:18.75:DICT_5X5_1000");
  calibrate->add_option("--ruler", options.ruler, "NOMINAL:MEASURED in mm, of the ruler printed beside it");
  calibrate->add_option("--code", options.code, "what is projected on it (pattern)")
      ->check(CLI::IsMember({"pattern", "gray"}));
  calibrate->add_option("--poses", options.poses, "how many poses to take (12)")->check(CLI::Range(3, 99));
  calibrate->add_flag("--resume", options.resume, "go on with the pictures of the last session");
}

void add_project(CLI::App& app, ClientOptions& options) {
  CLI::App* project = app.add_subcommand("project", "show a picture until the next scan");
  project->add_option("PICTURE", options.picture, "what to show; a file's image has the projector's size")
      ->required()
      ->check(kPicture);
  add_timeout(project, options);
}

void add_image(CLI::App& app, ClientOptions& options, const std::string& name, const std::string& what) {
  CLI::App* command = app.add_subcommand(name, what);
  command->add_option("-o,--output,FILE", options.image, "the PNG to write")->required();
  if (name != "pattern") add_timeout(command, options);
  if (name == "frame") command->add_flag("--as-shown", options.as_shown, "leave what the projector shows");
}

void add_view(CLI::App& app, ClientOptions& options) {
  CLI::App* metrics = app.add_subcommand("metrics", "what the service counts and measures, as text for Prometheus");
  metrics->add_option("-o,--output,FILE", options.output, "write it there, whole or not at all: for node_exporter");
  metrics->add_option("--format", options.format, "printed: openmetrics; in a file: prometheus, the older text format")
      ->check(CLI::IsMember({"openmetrics", "prometheus"}));
  CLI::App* bundle =
      app.add_subcommand("bundle", "write the last scans, with frames, settings and counters, to one file");
  bundle->add_option("-o,--output,FILE", options.output, "the file; without it slsd-TIME.tar, here");
  CLI::App* top = app.add_subcommand("top", "rates, latencies and states, live in a terminal");
  top->add_option("--interval", options.interval_s, "seconds between two looks (1)")->check(CLI::Range(0.1, 3600.0));
  top->add_option("--count", options.count, "end after so many looks")->check(CLI::Range(1, 1'000'000'000));
}

const CLI::Validator kAssignment(
    [](const std::string& text) {
      const bool whole = text.find('=') != std::string::npos && text.find('.') < text.find('=');
      return whole ? "" : "write TABLE.KEY=VALUE or camera.NAME.KEY=VALUE; the value \"default\" takes it back";
    },
    "TABLE.KEY=VALUE");

void add_set(CLI::App& app, ClientOptions& options) {
  app.add_subcommand("settings", "the settings that are given, and where each is from");
  CLI::App* set =
      app.add_subcommand("set", "set exposure, gain, pattern, calibration and decoder options without a restart");
  set->add_option("SETTING", options.assignments, "decode.KEY=VALUE or camera.NAME.exposure_us=N")
      ->required()
      ->check(kAssignment);
}

int run(const CLI::App& app, const ClientOptions& options) {
  const std::string command = app.get_subcommands().front()->get_name();
  if (command == "scan") return slsd::scan_command(options);
  if (command == "status") return slsd::status_command(options);
  if (command == "watch") return slsd::watch_command(options);
  if (command == "metrics") return slsd::metrics_command(options);
  if (command == "set") return slsd::set_command(options);
  if (command == "settings") return slsd::settings_command(options);
  if (command == "bundle") return slsd::bundle_command(options);
  if (command == "calibrate") return slsd::calibrate_command(options);
  if (command == "top") return slsd::top_command(options);
  if (command == "exposure") return slsd::exposure_command(options);
  if (command == "project") return slsd::project_command(options);
  if (command == "record") return slsd::record_command(options);
  return slsd::image_command(options, command);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Talks to slsd, the service of a structured-light scanner.\n"
      "Exit status: 0 done, 1 the request failed, 2 wrong usage, 3 no daemon.");
  ClientOptions options;
  app.set_version_flag("--version", "slsctl " SLSD_VERSION);
  app.add_option("--socket", options.socket, "the daemon's socket");
  app.add_flag("--json", options.json, "print JSON, errors too");
  app.require_subcommand(1);
  app.fallthrough();
  add_image(app, options, "frame", "write what the camera sees");
  add_image(app, options, "pattern", "write the pattern that the projector shows");
  add_image(app, options, "preview", "scan, and write the frame with what was decoded");
  add_calibrate(app, options);
  add_exposure(app, options);
  add_project(app, options);
  add_record(app, options);
  add_scan(app, options);
  app.add_subcommand("status", "the state of the service, and what its scans came to");
  add_watch(app, options);
  add_set(app, options);
  add_view(app, options);
  slsd::refuse_options_as_values(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? slsd::kDone : slsd::kWrongUsage;
  }
  return run(app, options);
}
