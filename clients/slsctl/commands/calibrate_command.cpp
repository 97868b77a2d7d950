// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <chrono>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "clients/connection/connection.hpp"
#include "clients/slsctl/commands/client_commands.hpp"
#include "clients/slsctl/report.hpp"
#include "core/printable.hpp"
#include "drivers/system/interrupt.hpp"
#include "rpc/message.hpp"

namespace slsd {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

constexpr auto kBetweenLooks = 200ms;
constexpr std::size_t kLineBytes = 500;

json parameters(const ClientOptions& options) {
  json params{{"action", options.action}};
  if (options.action != "begin") return params;
  if (!options.board.empty()) params["board"] = options.board;
  if (!options.ruler.empty()) params["ruler"] = options.ruler;
  if (!options.code.empty()) params["code"] = options.code;
  if (options.poses) params["poses"] = *options.poses;
  if (options.resume) params["resume"] = true;
  return params;
}

/// Prints each line of a session once. The service repeats the last few hundred lines each time.
class Log {
 public:
  void show(const json& told) {
    std::vector<std::string> lines;
    for (const json& line : told.value("log", json::array()))
      if (line.is_string()) lines.push_back(line.get<std::string>());
    std::size_t known = std::min(lines.size(), lines_.size());
    while (known > 0 && !std::equal(lines.begin(), lines.begin() + static_cast<std::ptrdiff_t>(known),
                                    lines_.end() - static_cast<std::ptrdiff_t>(known)))
      --known;
    for (std::size_t i = known; i < lines.size(); ++i) std::cout << printable(lines[i], kLineBytes) << "\n";
    std::cout << std::flush;
    lines_ = std::move(lines);
  }

 private:
  std::vector<std::string> lines_;
};

std::string state_line(const json& told) {
  const json progress = told.value("progress", json::object());
  const std::string state = progress.is_object() ? progress.value("state", "") : "";
  if (state.empty()) return "no calibration is under way\n";
  const std::string poses = progress.contains("poses") ? fmt::format(", {} of {} poses", progress.value("poses", 0),
                                                                     progress.value("wanted", 0))
                                                       : "";
  const json error = told.value("error", json());
  return printable(state) + poses +
         (error.is_string() ? ": " + printable(error.get<std::string>(), 2 * kLineBytes) : "") + "\n";
}

/// Reports the end of a session that was followed. @return the exit status
int conclude(const ClientOptions& options, const json& told) {
  const json error = told.value("error", json());
  if (error.is_string())
    return report(options, {kRequestFailed, rpc_error({ErrorCode::kImpossible, error.get<std::string>(), {}})});
  const json outcome = told.value("outcome", json());
  if (!options.json)
    std::cout << "in force: " << (outcome.is_object() ? outcome.value("grade", "") : "") << "\n" << std::flush;
  return std::cout ? kDone : kRequestFailed;
}

}  // namespace

int calibrate_command(const ClientOptions& options) {
  auto connection = Connection::open(options.socket);
  if (!connection) return report(options, failure(connection.error()));
  auto answered = ask(*connection, "calibrate", parameters(options));
  if (!answered) return report(options, answered.error());
  if (options.action != "begin") {
    const json& told = answered->reply.message["result"];
    std::cout << (options.json ? to_line(told) : state_line(told)) << std::flush;
    return kDone;
  }
  Interrupt::watch();
  Log log;
  json told = answered->reply.message["result"], number;
  for (bool ended = false;;) {
    if (!options.json) log.show(told);
    if (options.json && told.value("number", json()) != number) std::cout << to_line(told) << std::flush;
    number = told.value("number", json());
    if (!told.value("under_way", false)) return conclude(options, told);
    std::this_thread::sleep_for(kBetweenLooks);
    const bool ends = !ended && Interrupt::came();
    ended = ended || ends;
    answered = ask(*connection, "calibrate", json{{"action", ends ? "end" : "look"}});
    if (!answered) return report(options, answered.error());
    told = answered->reply.message["result"];
  }
}

}  // namespace slsd
