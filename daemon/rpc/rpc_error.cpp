// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/rpc/rpc_error.hpp"

#include <array>

namespace slsd {
namespace {

struct Entry {
  ErrorCode code;
  int number;
  std::string_view name;
};

// Numbers stay for good: programs outside compare them.
constexpr std::array kEntries{
    Entry{ErrorCode::kInvalidArgument, -32001, "invalid_argument"},
    Entry{ErrorCode::kMalformed, -32002, "malformed"},
    Entry{ErrorCode::kMismatch, -32003, "mismatch"},
    Entry{ErrorCode::kImpossible, -32004, "impossible"},
    Entry{ErrorCode::kNotFound, -32005, "not_found"},
    Entry{ErrorCode::kPermissionDenied, -32006, "permission_denied"},
    Entry{ErrorCode::kAlreadyExists, -32007, "already_exists"},
    Entry{ErrorCode::kNoSpace, -32008, "no_space"},
    Entry{ErrorCode::kIo, -32009, "io"},
    Entry{ErrorCode::kUnsupported, -32010, "unsupported"},
    Entry{ErrorCode::kBusy, -32011, "busy"},
    Entry{ErrorCode::kTimeout, -32012, "timeout"},
    Entry{ErrorCode::kCancelled, -32013, "cancelled"},
    Entry{ErrorCode::kDisconnected, -32014, "disconnected"},
    Entry{ErrorCode::kFrameDropped, -32015, "frame_dropped"},
    Entry{ErrorCode::kFrameTorn, -32016, "frame_torn"},
    Entry{ErrorCode::kFrameStale, -32017, "frame_stale"},
    Entry{ErrorCode::kFrameLate, -32018, "frame_late"},
    Entry{ErrorCode::kFrameSkewed, -32019, "frame_skewed"},
};

constexpr const Entry& entry(ErrorCode code) {
  for (const Entry& each : kEntries) {
    if (each.code == code) return each;
  }
  return kEntries.front();
}

}  // namespace

std::string_view to_string(ErrorCode code) {
  return entry(code).name;
}

int rpc_code(ErrorCode code) {
  return entry(code).number;
}

nlohmann::json RpcError::to_json() const {
  nlohmann::json data{{"name", name}};
  if (!where.empty()) data["where"] = where;
  return {{"code", code}, {"message", where.empty() ? message : where + ": " + message}, {"data", std::move(data)}};
}

RpcError parse_error(std::string message) {
  return {-32700, "parse_error", std::move(message), {}};
}

RpcError invalid_request(std::string message) {
  return {-32600, "invalid_request", std::move(message), {}};
}

RpcError method_not_found(std::string message) {
  return {-32601, "method_not_found", std::move(message), {}};
}

RpcError invalid_params(std::string message) {
  return {-32602, "invalid_params", std::move(message), {}};
}

RpcError rpc_error(const Error& error) {
  return {rpc_code(error.code), std::string(to_string(error.code)), error.message, error.where};
}

}  // namespace slsd
