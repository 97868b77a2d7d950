// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "clients/web/request.hpp"

namespace slsd::web {

/// Tells whether an error means that the service is away: nothing listens, it hung up, or it is stopping.
/// @param name   the error's `data.name`, as docs/protocol.md lists them
/// @param where  the error's `data.where`
[[nodiscard]] inline bool is_away(std::string_view name, const std::string& where,
                                  const std::filesystem::path& socket) {
  return name == "cancelled" || (where == socket && (name == "not_found" || name == "disconnected"));
}

/// The answer to every request while the service is away.
[[nodiscard]] inline Refusal no_service(const std::filesystem::path& socket) {
  return {
      503, "no_service",
      socket.string() + ": no service answers there: start slsd (sudo systemctl start slsd), or wait if it restarts"};
}

}  // namespace slsd::web
