// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <functional>
#include <map>

#include <CLI/CLI.hpp>

#include "daemon/client/client_commands.hpp"
#include "daemon/client/client_options.hpp"

namespace {

using slsd::ClientOptions;

const CLI::Validator kCloudFile(
    [](const std::string& file) {
      const auto extension = std::filesystem::path(file).extension();
      return extension == ".ply" || extension == ".pcd" ? "" : "a cloud's file ends in .ply or .pcd";
    },
    "CLOUD.ply|CLOUD.pcd");

void add_timeout(CLI::App* command, ClientOptions& options) {
  command->add_option("--timeout-ms", options.timeout_ms, "how long to wait for devices and frames")
      ->check(CLI::Range(1, 600'000));
}

void add_scan(CLI::App& app, ClientOptions& options) {
  CLI::App* scan = app.add_subcommand("scan", "trigger one scan, wait, write the cloud");
  scan->add_option("-o,--output", options.output, "write the cloud, as PLY or PCD")->check(kCloudFile);
  scan->add_option("--picture", options.picture, "write the frame with what was decoded, as a PNG");
  scan->add_option("--cloud-picture", options.cloud_picture, "write a picture of the cloud, as a PNG");
  add_timeout(scan, options);
}

void add_watch(CLI::App& app, ClientOptions& options) {
  CLI::App* watch = app.add_subcommand("watch", "a line for each cloud as it comes");
  watch->add_option("--count", options.count, "end after so many clouds")->check(CLI::Range(1, 1'000'000'000));
  watch->add_option("--rate", options.rate_hz, "at most so many a second")->check(CLI::Range(0.001, 1000.0));
}

void add_image(CLI::App& app, ClientOptions& options, const std::string& name, const std::string& what) {
  CLI::App* command = app.add_subcommand(name, what);
  command->add_option("FILE", options.image, "the PNG to write")->required();
  if (name != "pattern") add_timeout(command, options);
}

int run(const CLI::App& app, const ClientOptions& options) {
  const std::string command = app.get_subcommands().front()->get_name();
  if (command == "scan") return slsd::scan_command(options);
  if (command == "status") return slsd::status_command(options);
  if (command == "watch") return slsd::watch_command(options);
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
  add_image(app, options, "pattern", "write what the projector shows");
  add_image(app, options, "preview", "scan, and write the frame with what was decoded");
  add_scan(app, options);
  app.add_subcommand("status", "the state of the service, and what its scans came to");
  add_watch(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? slsd::kDone : slsd::kWrongUsage;
  }
  return run(app, options);
}
