// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <iostream>

#include "clients/slsctl/commands/client_commands.hpp"
#include "clients/slsctl/output.hpp"
#include "clients/slsctl/report.hpp"
#include "core/printable.hpp"
#include "rpc/message.hpp"

namespace slsd {
namespace {

using nlohmann::json;

constexpr std::size_t kShownBytes = 1000;

std::string text_of_value(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

int list_presets(const ClientOptions& options, const json& result) {
  if (options.json) {
    std::cout << to_line(result);
    return kDone;
  }
  const json presets = result.value("presets", json::object()), in_force = result.value("in_force", json());
  for (const auto& [name, preset] : presets.items())
    std::cout << printable(name, kShownBytes) << (in_force == name ? "  (in force)" : "") << "\n";
  return kDone;
}

// Prints the settings as `slsctl set` takes them.
void print_keys(const std::string& where, const json& keys) {
  for (const auto& [key, value] : keys.items()) {
    if (value.is_object()) {
      print_keys(where + key + ".", value);
    } else {
      std::cout << printable(where + key + "=" + text_of_value(value), kShownBytes) << "\n";
    }
  }
}

}  // namespace

int preset_command(const ClientOptions& options) {
  if (options.action == "list" || options.action == "show") {
    const auto answered = options.action == "list" ? ask(options, "presets", json::object())
                                                   : ask(options, "presets", {{"name", options.preset}});
    if (!answered) return report(options, answered.error());
    const json& result = answered->reply.message["result"];
    if (options.action == "list") return list_presets(options, result);
    const json preset = result["presets"].value(options.preset, json::object());
    options.json ? void(std::cout << to_line(preset)) : print_keys("", preset.value("settings", json::object()));
    return kDone;
  }
  const auto answered = ask(options, "preset", {{"action", options.action}, {"name", options.preset}});
  if (!answered) return report(options, answered.error());
  if (options.json) std::cout << to_line(answered->reply.message["result"]);
  return kDone;
}

}  // namespace slsd
