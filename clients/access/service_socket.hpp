// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <sys/un.h>

#include <filesystem>

#include "core/result.hpp"

namespace slsd {

/// Checks the path of the service's socket, so that a program refuses at its start what can never answer.
/// @errors kInvalidArgument: longer than the address of a socket
[[nodiscard]] inline Result<> check_service_socket(const std::filesystem::path& socket) {
  if (socket.native().size() < sizeof(sockaddr_un::sun_path)) return {};
  return fail(ErrorCode::kInvalidArgument, "the socket's path is longer than 107 bytes: choose a shorter one",
              socket.string());
}

}  // namespace slsd
