// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/slsctl/commands/client_commands.hpp"

#include <iostream>

#include "clients/connection/connection.hpp"
#include "clients/slsctl/output.hpp"
#include "clients/slsctl/progress.hpp"
#include "clients/slsctl/report.hpp"
#include "core/base64.hpp"
#include "core/printable.hpp"
#include "drivers/files/file.hpp"
#include "rpc/message.hpp"

namespace slsd {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxImageBytes = 64 << 20;

int print_event(const ClientOptions& options, const json& event) {
  const json params = event.value("params", json::object());
  if (options.json) {
    std::cout << to_line(event) << std::flush;
  } else if (event.value("method", "") == "cloud") {
    std::cout << scan_line(params) << ", " << params.value("lost", 0) << " lost\n" << empty_line(params) << std::flush;
  } else if (params.contains("error")) {
    std::cout << "scan failed: " << printable(params["error"].value("message", "")) << "\n" << std::flush;
  }
  return event.value("method", "") == "cloud" ? 1 : 0;
}

}  // namespace

int status_command(const ClientOptions& options) {
  const auto answered = ask(options, "status", json::object());
  if (!answered) return report(options, answered.error());
  const json& result = answered->reply.message["result"];
  std::cout << (options.json ? to_line(result) : status_table(result));
  return kDone;
}

int watch_command(const ClientOptions& options) {
  auto connection = Connection::open(options.socket);
  if (!connection) return report(options, failure(connection.error()));
  json params{{"format", "ply"}};
  if (!options.density.empty()) params["density"] = options.density;
  if (options.rate_hz) params["rate_hz"] = *options.rate_hz;
  const auto answered = ask(*connection, "subscribe", params);
  if (!answered) return report(options, answered.error());
  std::uint64_t clouds = 0;
  while (options.count == 0 || clouds < options.count) {
    const auto event = connection->receive();
    if (!event) return report(options, failure(event.error()));
    clouds += static_cast<std::uint64_t>(print_event(options, event->message));
    if (!std::cout) return kRequestFailed;
  }
  return kDone;
}

int image_command(const ClientOptions& options, const std::string& method) {
  if (auto writable = check_outputs(options); !writable) return report(options, writable.error());
  auto connection = Connection::open(options.socket);
  if (!connection) return report(options, failure(connection.error()));
  json params = json::object();
  if (!options.camera.empty()) params["camera"] = options.camera;
  if (options.timeout_ms && method != "pattern") params["timeout_ms"] = *options.timeout_ms;
  if (options.as_shown) params["as_shown"] = true;
  const Progress progress(options, *connection, method == "pattern" ? "drawing" : "scanning");
  const auto answered = ask(*connection, method, params);
  if (!answered) return report(options, answered.error());
  if (auto written = write_output(options.image, answered->reply.bytes); !written)
    return report(options, written.error());
  if (options.json) words(options) << to_line(answered->reply.message["result"]);
  return kDone;
}

// "camera.NAME.KEY=VALUE": a name may contain dots, a key may not.
int set_command(const ClientOptions& options) {
  json params = json::object();
  for (const std::string& assignment : options.assignments) {
    const std::string where = assignment.substr(0, assignment.find('='));
    const std::string text = assignment.substr(std::min(where.size() + 1, assignment.size()));
    const std::size_t first = where.find('.'), last = where.rfind('.');
    json value = text == "default" ? json() : json::parse(text, nullptr, /*allow_exceptions=*/false);
    if (value.is_discarded()) value = text;
    const std::string table = where.substr(0, first), key = last == std::string::npos ? "" : where.substr(last + 1);
    if (table == "camera" && first != last) {
      params[table][where.substr(first + 1, last - first - 1)][key] = std::move(value);
    } else {
      params[table][key] = std::move(value);
    }
  }
  const auto answered = ask(options, "set", params);
  if (!answered) return report(options, answered.error());
  const json& result = answered->reply.message["result"];
  if (options.json) std::cout << to_line(result);
  if (const json why = result.value("not_kept", json()); !options.json && why.is_string())
    std::cerr << "slsctl: in force, but not saved for the next start: " << printable(why.get<std::string>(), 1000)
              << "\n";
  return kDone;
}

namespace {

void print_settings(const json& keys, const json& set, const std::string& where, const std::string& file) {
  for (const auto& [key, value] : keys.items()) {
    const bool here = set.is_object() && set.contains(key);
    std::cout << printable(where + key + " = " + value.dump(-1, ' ', false, json::error_handler_t::replace), 1000)
              << "  (" << (here ? "set" : file) << ")\n";
  }
}

}  // namespace

// Prints the source of each key; keys that are not listed have defaults.
int settings_command(const ClientOptions& options) {
  const auto answered = ask(options, "settings", json::object());
  if (!answered) return report(options, answered.error());
  const json& result = answered->reply.message["result"];
  if (options.json) {
    std::cout << to_line(result);
    return kDone;
  }
  const std::string file = printable(std::filesystem::path(result.value("file", "")).filename().string(), 200);
  const json set = result.value("set", json::object()), given = result.value("configuration", json::object());
  for (const auto& [table, keys] : given.items()) {
    const json of_table = set.value(table, json::object());
    if (keys.is_object()) print_settings(keys, of_table, table + ".", file);
    for (const json& camera : keys.is_array() ? keys : json::array()) {
      if (!camera.is_object()) continue;
      const std::string name = camera.value("name", "camera");
      print_settings(camera, of_table.value(name, json()), table + "." + name + ".", file);
    }
  }
  return kDone;
}

int project_command(const ClientOptions& options) {
  json params{{"picture", options.shown.string()}};
  if (lower_extension(options.shown) == ".png") {
    const auto image = read_file(options.shown, kMaxImageBytes);
    if (!image) return report(options, Failure{kRequestFailed, rpc_error(image.error())});
    params = {{"picture", "image"}, {"png", to_base64(*image)}};
  }
  if (options.timeout_ms) params["timeout_ms"] = *options.timeout_ms;
  auto answered = ask(options, "project", params);
  if (!answered && answered.error().error.name == "invalid_request" && params.contains("png")) {
    answered.error().error.where = options.shown.string();
    answered.error().error.message =
        "the file is too long for one request: save it in grey, or set [server] request_bytes_max to more than " +
        std::to_string(params.dump().size());
  }
  if (!answered) return report(options, answered.error());
  if (options.json) std::cout << to_line(answered->reply.message["result"]);
  return kDone;
}

}  // namespace slsd
