// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "daemon/rpc/rpc_error.hpp"

namespace slsd {

/// One JSON object to a line, line feed included. A text that is no UTF-8 (a file's name may be any bytes) gets
/// replacement characters.
[[nodiscard]] std::string to_line(const nlohmann::json& message);

[[nodiscard]] nlohmann::json result_message(const nlohmann::json& id, nlohmann::json result);
[[nodiscard]] nlohmann::json error_message(const nlohmann::json& id, const RpcError& error);
[[nodiscard]] nlohmann::json event_message(std::string_view method, nlohmann::json params);
[[nodiscard]] nlohmann::json request_message(std::int64_t id, std::string_view method, nlohmann::json params);

}  // namespace slsd
