// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "clients/slsctl/client_options.hpp"
#include "clients/slsctl/commands/client_commands.hpp"
#include "clients/slsctl/output.hpp"
#include "clients/usage/datasheet_usage.hpp"
#include "clients/usage/hand_eye_usage.hpp"
#include "clients/usage/usage.hpp"
#include "core/geometry/robot_pose.hpp"
#include "core/shown_picture.hpp"
#include "drivers/files/file.hpp"

namespace {

using slsd::between;
using slsd::ClientOptions;
using slsd::one_of;

constexpr double kManyTimes = 1e9;

const char* const kMeasure = "Measure";
const char* const kWatch = "Watch";
const char* const kSetUp = "Set up";
const char* const kDiagnose = "Diagnose";

/// Adds a command to a group of the help, with examples below its options.
CLI::App* add_command(CLI::App& app, const char* group, const std::string& name, const std::string& what,
                      const std::string& examples) {
  CLI::App* command = app.add_subcommand(name, what);
  command->group(group);
  command->footer("Examples:\n" + examples + "\nEvery command takes --socket and --json: see slsctl --help");
  return command;
}

void add_camera(CLI::App* command, ClientOptions& options, const std::string& what) {
  command->add_option("--camera", options.camera, what)->type_name("NAME");
}

void add_density(CLI::App* command, ClientOptions& options) {
  command->add_option("--density", options.density, "a point for each symbol, or for each camera pixel")
      ->check(one_of({"symbols", "pixels"}));
}

/// Adds the options that choose a part of the scene.
void add_part(CLI::App* command, ClientOptions& options) {
  command->add_option("--box", options.box, "measure only within this box: its least and its greatest corner, in mm")
      ->delimiter(',')
      ->expected(6)
      ->type_name("X,Y,Z,X,Y,Z");
  command->add_option("--box-frame", options.box_frame, "the frame of the box (as configured)")
      ->check(one_of({"rig", "robot_base"}));
  command
      ->add_option("--voxel-mm", options.voxel_mm,
                   "keep only the most certain point in each cube with this side length")
      ->check(between(0, 1000))
      ->type_name("MM");
  command->add_option("--stride", options.stride, "keep the pixels of every Nth row and column; needs --density pixels")
      ->check(between(1, 64))
      ->type_name("N");
  command->add_option("--preset", options.preset, "scan with the settings of this preset, which stay in force")
      ->type_name("NAME");
}

void add_timeout(CLI::App* command, ClientOptions& options) {
  command->add_option("--timeout-ms", options.timeout_ms, "how long to wait for devices and frames (5000)")
      ->check(between(1, 600'000))
      ->type_name("N");
}

void add_count(CLI::App* command, ClientOptions& options, const std::string& name, const std::string& what) {
  command->add_option(name, options.count, what)->check(between(1, kManyTimes))->type_name("N");
}

void add_scan(CLI::App& app, ClientOptions& options) {
  CLI::App* scan = add_command(app, kMeasure, "scan", "take one scan and write its point cloud",
                               "  slsctl scan cloud.ply\n"
                               "  slsctl scan --density pixels depth.tiff\n"
                               "  slsctl scan part.stl\n"
                               "  slsctl scan cloud.ply --poses ur --robot-pose=0.41,-0.23,0.61,2.9,0.12,0.04\n"
                               "  slsctl scan --format pcd -o - | my-program\n");
  CLI::Option* output =
      scan->add_option("-o,--output,CLOUD", options.output,
                       "the file to write: .ply, .pcd or .tiff, or a mesh as .stl, .obj or .glb; - is standard output")
          ->type_name("FILE");
  scan->add_option("--format", options.format, "the format, if the file's name does not show it")
      ->check(one_of({"ply", "pcd", "tiff", "stl", "obj", "glb"}))
      ->needs(output);
  add_density(scan, options);
  add_part(scan, options);
  scan->add_option("--coordinate-frame", options.coordinate_frame, "the frame of the points (as configured)")
      ->check(one_of({"rig", "robot_base"}));
  CLI::Option* notation =
      scan->add_option("--poses", options.pose_notation, "the notation of the robot's pose; slsctl(1) explains each")
          ->check(one_of(slsd::pose_notation_names()));
  CLI::Option* pose =
      scan->add_option("--robot-pose", options.robot_pose, "the robot's pose, if the scanner is on its arm")
          ->expected(6, 16)
          ->delimiter(',')
          ->type_name("N,N,...")
          ->needs(notation);
  notation->needs(pose);
  scan->add_flag("--normals", options.normals, "also write the surface's normals; needs --density pixels");
  scan->add_flag("--mesh", options.mesh,
                 "join the points into triangles, as .stl, .obj and .glb always do; needs --density pixels");
  scan->add_flag("--colour", options.colour, "also write each point's colour, from a frame in white light");
  scan->add_flag("--texture", options.texture, "also take a frame in white light, for the points' intensities");
  scan->add_flag("--ambient", options.ambient,
                 "also take a frame without the projector's light, and subtract the room's light");
  CLI::Option* picture =
      scan->add_option("--picture", options.picture, "write the camera's frame with the decoded symbols drawn in")
          ->type_name("FILE.png");
  scan->add_flag("--why", options.why, "with --picture: mark each rejected region with the rule that rejected it")
      ->needs(picture);
  scan->add_option("--cloud-picture", options.cloud_picture, "write a picture of the cloud")->type_name("FILE.png");
  add_camera(scan, options, "the camera of --picture (the first)");
  add_timeout(scan, options);
}

void add_record(CLI::App& app, ClientOptions& options) {
  CLI::App* record = add_command(app, kMeasure, "record", "scan repeatedly, and keep the frames for replay",
                                 "  slsctl record session-1 --frames 100\n"
                                 "  slsctl record session-2 --seconds 60 --clouds\n"
                                 "  slsctl record turning --clouds --density pixels\n");
  record->add_option("DIR", options.folder, "a new or an empty folder")->required()->type_name("FOLDER");
  add_count(record, options, "--frames", "end after this many scans");
  record->add_option("--seconds", options.seconds, "end after this many seconds")
      ->check(between(0.001, 1e9))
      ->type_name("S");
  CLI::Option* clouds = record->add_flag("--clouds", options.clouds, "also keep the clouds");
  add_density(record, options);
  add_part(record, options);
  record->add_flag("--normals", options.normals, "also keep the surface's normals; needs --density pixels")
      ->needs(clouds);
  add_timeout(record, options);
}

void add_watching(CLI::App& app, ClientOptions& options) {
  add_command(app, kWatch, "status", "show the state of the service, devices and scans", "  slsctl status\n");
  CLI::App* watch = add_command(app, kWatch, "watch", "scan continuously, and print a line for each cloud",
                                "  slsctl watch --rate 2\n  slsctl watch --count 1 --json\n");
  add_count(watch, options, "--count", "end after this many clouds");
  watch->add_option("--rate", options.rate_hz, "at most this many clouds per second")
      ->check(between(0.001, 1000.0))
      ->type_name("HZ");
  add_density(watch, options);
  CLI::App* top = add_command(app, kWatch, "top", "show rates, times and states live",
                              "  slsctl top\n  slsctl top --interval 10 --json\n");
  top->add_option("--interval", options.interval_s, "seconds between updates (1)")
      ->check(between(0.1, 3600.0))
      ->type_name("S");
  add_count(top, options, "--count", "end after this many updates");
  CLI::App* metrics = add_command(app, kWatch, "metrics", "print the service's metrics, as text for Prometheus",
                                  "  slsctl metrics\n  slsctl metrics -o /var/lib/node_exporter/slsd.prom\n");
  metrics->add_option("-o,--output,FILE", options.output, "the file to write; readers always see a complete file")
      ->type_name("FILE");
  metrics
      ->add_option("--format", options.metrics_format,
                   "default: openmetrics; with --output: prometheus, the older text format")
      ->check(one_of({"openmetrics", "prometheus"}));
}

void add_image(CLI::App& app, ClientOptions& options, const char* group, const std::string& name,
               const std::string& what, const std::string& examples) {
  CLI::App* command = add_command(app, group, name, what, examples);
  command->add_option("-o,--output,FILE", options.image, "the PNG to write; - is standard output")
      ->required()
      ->type_name("FILE.png");
  if (name == "pattern") return;
  add_camera(command, options, "which camera (the first)");
  add_timeout(command, options);
  if (name == "frame") command->add_flag("--as-shown", options.as_shown, "leave the projected picture unchanged");
}

const CLI::Validator kPicture(
    [](const std::string& picture) {
      const bool named = picture != "image" && picture != "held" && slsd::picture_named(picture);
      if (named || slsd::lower_extension(picture) == ".png") return std::string();
      return slsd::quoted(picture) +
             " is neither pattern, idle, white, black, focus nor grid, nor a file that ends in .png";
    },
    "{pattern,idle,white,black,focus,grid} or FILE.png");

const CLI::Validator kAssignment(
    [](const std::string& text) {
      const bool whole = text.find('=') != std::string::npos && text.find('.') < text.find('=');
      return whole ? std::string()
                   : slsd::quoted(text) + " is not a setting: write TABLE.KEY=VALUE or camera.NAME.KEY=VALUE";
    },
    "");

void add_calibrate(CLI::App& app, ClientOptions& options) {
  CLI::App* calibrate = add_command(app, kSetUp, "calibrate", "calibrate with the service's devices, pose by pose",
                                    "  slsctl calibrate --board charuco:11x7:23:17.25:DICT_5X5_1000\n"
                                    "  slsctl calibrate --resume --poses 20\n"
                                    "  slsctl calibrate cancel\n");
  calibrate
      ->add_option("ACTION", options.action,
                   "begin: start a calibration and follow it; look, end, cancel: show, finish or abort the current one")
      ->check(one_of({"begin", "look", "end", "cancel"}));
  calibrate->add_option("--board", options.board, "the board; slsd(8) lists the kinds");
  calibrate->add_option("--ruler", options.ruler, "the printed ruler's nominal and measured length, in mm")
      ->type_name("NOMINAL:MEASURED");
  calibrate->add_option("--code", options.code, "what to project onto the board (pattern)")
      ->check(one_of({"pattern", "gray"}));
  calibrate->add_option("--poses", options.poses, "how many poses to take (12)")->check(between(3, 99))->type_name("N");
  calibrate->add_flag("--resume", options.resume, "continue with the pictures of the last session");
}

void add_hand_eye(CLI::App& app, slsd::HandEyeRequest& request) {
  CLI::App* hand_eye = add_command(app, kSetUp, "hand-eye", slsd::kHandEyePurpose, slsd::kHandEyeExamples);
  slsd::add_hand_eye_options(*hand_eye, request);
}

void add_datasheet(CLI::App& app, slsd::DatasheetRequest& request) {
  CLI::App* datasheet = add_command(app, kSetUp, "datasheet", slsd::kDatasheetPurpose, slsd::kDatasheetExamples);
  slsd::add_datasheet_options(*datasheet, request);
}

void add_exposure(CLI::App& app, ClientOptions& options) {
  CLI::App* exposure = add_command(app, kSetUp, "exposure", "measure the scene's light, and propose exposure and gain",
                                   "  slsctl exposure\n  slsctl exposure --camera left --gain-max-db 6\n");
  add_camera(exposure, options, "which camera (the first)");
  exposure->add_option("--exposure-max-us", options.exposure_max_us, "the longest exposure to propose (100000)")
      ->check(between(1.0, 1e7))
      ->type_name("N");
  exposure->add_option("--gain-max-db", options.gain_max_db, "the highest gain to propose (24)")
      ->check(between(0.0, 60.0))
      ->type_name("N");
  add_timeout(exposure, options);
}

void add_light(CLI::App& app, ClientOptions& options) {
  CLI::App* light = add_command(app, kDiagnose, "light",
                                "report the light in a camera's frames: blur, clipping, room light, noise, gamma",
                                "  slsctl light\n  slsctl light --camera left --picture light.png\n");
  CLI::Option* camera = light->add_option("--camera", options.camera, "which camera (the first)")->type_name("NAME");
  light->add_option("--from", options.from, "read one or two frames from files, without the service")
      ->expected(1, -1)  // wrong_frames() limits them, with a better message
      ->excludes(camera)
      ->type_name("FRAME.png");
  light->add_option("--picture", options.picture, "write the frame with clipping, room light and blur drawn in")
      ->type_name("FILE.png");
  add_timeout(light, options);
}

/// The error in the frames of --from; empty: none.
std::string wrong_frames(const ClientOptions& options) {
  constexpr std::size_t kMost = 2;
  if (options.from.size() <= kMost) return {};
  return fmt::format("--from takes one or two frames of one camera, not {}: leave out {}{}", options.from.size(),
                     slsd::quoted(options.from[kMost].string()),
                     options.from.size() > kMost + 1 ? " and those after it" : "");
}

void add_project(CLI::App& app, ClientOptions& options) {
  CLI::App* project = add_command(app, kSetUp, "project", "project a picture until the next scan",
                                  "  slsctl project focus\n  slsctl project chart.png\n  slsctl project idle\n");
  project->add_option("PICTURE", options.shown, "what to project; an image must have the projector's size")
      ->required()
      ->check(kPicture);
  add_timeout(project, options);
}

void add_settings(CLI::App& app, ClientOptions& options) {
  CLI::App* set = add_command(app, kSetUp, "set", "change settings without a restart, and keep them",
                              "  slsctl set camera.left.exposure_us=8000\n"
                              "  slsctl set decode.density=pixels decode.depth_max_mm=1500\n"
                              "  slsctl set decode.density=default\n");
  set->add_option("SETTING", options.assignments, "decode.KEY=VALUE or camera.NAME.exposure_us=N; =default resets it")
      ->required()
      ->check(kAssignment)
      ->type_name("TABLE.KEY=VALUE");
  add_command(app, kSetUp, "settings", "list the settings that were set, and the source of each",
              "  slsctl settings\n");
}

/// The error in a preset's command; empty: none.
std::string wrong_preset(const ClientOptions& options, const std::string& command) {
  if (command != "preset") return {};
  if (options.action == "list") return options.preset.empty() ? "" : "preset list takes no name";
  return options.preset.empty() ? "NAME is missing: preset " + options.action + " NAME" : "";
}

void add_plane(CLI::App& app, ClientOptions& options) {
  CLI::App* plane = add_command(app, kSetUp, "plane", "measure the plane in view, such as a table, and subtract it",
                                "  slsctl plane\n"
                                "  slsctl plane --set --margin-mm 2\n"
                                "  slsctl set cloud.plane=default\n");
  plane->add_flag("--set", options.set, "drop all points on or behind the plane in all further scans");
  plane
      ->add_option("--margin-mm", options.margin_mm,
                   "also drop points up to this far in front of the plane (5 times the scatter of its points)")
      ->check(between(0, 1000))
      ->type_name("MM");
  add_timeout(plane, options);
}

void add_preset(CLI::App& app, ClientOptions& options) {
  CLI::App* preset = add_command(app, kSetUp, "preset", "save the current settings under a name, and use them again",
                                 "  slsctl preset save part-a\n"
                                 "  slsctl preset list\n"
                                 "  slsctl preset use part-a\n"
                                 "  slsctl preset show part-a\n");
  preset->add_option("ACTION", options.action, "what to do")
      ->required()
      ->check(one_of({"save", "use", "list", "show", "delete"}));
  preset->add_option("NAME", options.preset, "the preset's name: letters, digits, dots, dashes, underscores")
      ->type_name("NAME");
}

void add_bundle(CLI::App& app, ClientOptions& options) {
  CLI::App* bundle = add_command(app, kDiagnose, "bundle", "write the last scans with their frames and settings",
                                 "  slsctl bundle\n  slsctl bundle fault.tar\n");
  bundle->add_option("-o,--output,FILE", options.output, "the file to write (slsd-TIME.tar); - is standard output")
      ->type_name("FILE.tar");
}

void add_commands(CLI::App& app, ClientOptions& options) {
  add_scan(app, options);
  add_record(app, options);
  add_watching(app, options);
  add_calibrate(app, options);
  add_exposure(app, options);
  add_project(app, options);
  add_image(app, options, kSetUp, "frame", "write a camera's frame", "  slsctl frame left.png --camera left\n");
  add_settings(app, options);
  add_plane(app, options);
  add_preset(app, options);
  add_image(app, options, kDiagnose, "preview", "scan, and write the frame with the decoded symbols drawn in",
            "  slsctl preview decoded.png\n");
  add_image(app, options, kDiagnose, "pattern", "write the image of the pattern", "  slsctl pattern pattern.png\n");
  add_light(app, options);
  add_bundle(app, options);
}

int run(const std::string& command, const ClientOptions& options) {
  if (command == "scan") return slsd::scan_command(options);
  if (command == "status") return slsd::status_command(options);
  if (command == "watch") return slsd::watch_command(options);
  if (command == "metrics") return slsd::metrics_command(options);
  if (command == "set") return slsd::set_command(options);
  if (command == "plane") return slsd::plane_command(options);
  if (command == "preset") return slsd::preset_command(options);
  if (command == "settings") return slsd::settings_command(options);
  if (command == "bundle") return slsd::bundle_command(options);
  if (command == "calibrate") return slsd::calibrate_command(options);
  if (command == "top") return slsd::top_command(options);
  if (command == "exposure") return slsd::exposure_command(options);
  if (command == "light") return slsd::light_command(options);
  if (command == "project") return slsd::project_command(options);
  if (command == "record") return slsd::record_command(options);
  return slsd::image_command(options, command);
}

/// Turns "help scan" into "scan --help".
std::vector<const char*> without_help_command(int argc, char** argv) {
  std::vector<const char*> arguments(argv, argv + argc);
  if (argc < 2 || std::string_view(argv[1]) != "help") return arguments;
  arguments.erase(arguments.begin() + 1);
  arguments.push_back("--help");
  return arguments;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Controls slsd, the service of a structured-light scanner.\nExit status: 0 done, 1 the request failed, 2 wrong "
      "usage, 3 no service answers.",
      "slsctl");
  ClientOptions options;
  app.set_version_flag("--version", "slsctl " SLSD_VERSION);
  app.add_option("--socket", options.socket,
                 "the service's socket (SLSD_SOCKET in the environment, or /run/slsd/slsd.sock)")
      ->type_name("PATH");
  app.add_flag("--json", options.json, "print JSON, one object per line, also for errors");
  app.require_subcommand(1);
  app.fallthrough();
  app.footer("\"slsctl COMMAND --help\" shows the options of a command and examples.");
  add_commands(app, options);
  slsd::HandEyeRequest hand_eye;  // checked here, carried out by slsd-hand-eye
  add_hand_eye(app, hand_eye);
  slsd::DatasheetRequest datasheet;  // likewise, by slsd-datasheet
  add_datasheet(app, datasheet);
  const auto arguments = without_help_command(argc, argv);
  std::string command;
  const auto check = [&] {
    command = app.get_subcommands().front()->get_name();
    auto wrong = wrong_frames(options);
    if (wrong.empty()) wrong = wrong_preset(options, command);
    if (wrong.empty() && command == "datasheet") wrong = slsd::wrong_datasheet(datasheet);
    if (wrong.empty()) wrong = slsd::wrong_outputs(options, command);
    if (!wrong.empty()) throw CLI::ValidationError(wrong);
  };
  if (const auto ended = slsd::parse_usage(app, static_cast<int>(arguments.size()), arguments.data(), check))
    return *ended;
  if (command == "hand-eye") return slsd::separate_command(options, slsd::kHandEyeProgram, argv);
  if (command == "datasheet") return slsd::separate_command(options, slsd::kDatasheetProgram, argv);
  return slsd::finish(options, run(command, options));
}
