// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/server_options.hpp"

#include "daemon/configuration/in_range.hpp"

namespace slsd {

Result<> ServerOptions::validate() const {
  const std::size_t length = socket.string().size();
  if (length == 0 || length > kMaxSocketPath) {
    return fail(ErrorCode::kInvalidArgument, "socket must be a path of 1 to " + std::to_string(kMaxSocketPath) +
                                                 " bytes, not " + std::to_string(length) + ": choose a shorter one");
  }
  if (auto valid = in_range("socket_mode", socket_mode, 0, 0777); !valid) return valid;
  if (auto valid = in_range("clients_max", clients_max, 1, 10'000); !valid) return valid;
  if (auto valid = in_range("request_bytes_max", request_bytes_max, 1024, 16 * 1024 * 1024); !valid) return valid;
  return in_range("send_timeout_ms", send_timeout_ms, 100, 600'000);
}

}  // namespace slsd
