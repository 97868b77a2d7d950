// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <csignal>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>

#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>

#include "daemon/service/commands.hpp"
#include "daemon/service/logging.hpp"
#include "daemon/service/service.hpp"

namespace {

constexpr int kDone = 0;
constexpr int kFailed = 1;
constexpr int kWrongUsage = 2;

int serve(const std::filesystem::path& configuration_file) {
  std::signal(SIGHUP, SIG_IGN);  // what a reload would read is about to be read
  spdlog::info("slsd {} starts with {}", SLSD_VERSION, configuration_file.string());
  auto service = slsd::Service::create(configuration_file);
  const auto served = service ? (*service)->run() : slsd::Result<>(tl::unexpected(service.error()));
  if (!served) spdlog::critical("{}", to_string(served.error()));
  return served ? kDone : kFailed;
}

int report(const slsd::Result<>& result) {
  if (!result) std::cerr << "slsd: " << to_string(result.error()) << "\n";
  return result ? kDone : kFailed;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("The service of a single-shot structured-light scanner. Without an option it serves in the foreground.");
  std::optional<std::filesystem::path> configuration;
  std::filesystem::path image;
  std::string level = "info";
  app.set_version_flag("--version", "slsd " SLSD_VERSION);
  app.add_option("--config", configuration, "configuration file; without it " + std::string(slsd::kConfigurationFile));
  app.add_option("--log-level", level, "least level that is logged")
      ->check(CLI::IsMember({"trace", "debug", "info", "warning", "error", "critical"}));
  auto* pattern = app.add_option("--pattern", image, "write the image that the projector shows, as a PNG");
  bool wants_check = false;
  bool wants_list = false;
  auto* check = app.add_flag("--check", wants_check, "look at everything that a scan needs, and say what to do");
  auto* list = app.add_flag("--list", wants_list, "list cameras and projectors");
  pattern->excludes(check)->excludes(list);
  check->excludes(list);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kWrongUsage;
  }
  slsd::start_logging(spdlog::level::from_str(level));
  if (*pattern) return report(slsd::write_pattern_image(configuration, image));
  if (wants_list) return report(slsd::list_devices(configuration));
  if (wants_check) return slsd::check_everything(configuration) ? kDone : kFailed;
  return serve(configuration.value_or(slsd::kConfigurationFile));
}
