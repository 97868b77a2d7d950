// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "rpc/line_buffer.hpp"
#include "rpc/message.hpp"
#include "rpc/param_reader.hpp"
#include "rpc/request.hpp"

namespace {

void read_params(const nlohmann::json& params) {
  slsd::ParamReader reader(params);
  (void)reader.choice("format", {"ply", "pcd"});
  (void)reader.integer("timeout_ms", 5000, 1, 600000);
  (void)reader.number("rate_hz", 0.001, 1000);
  (void)reader.boolean("picture", false);
  (void)reader.text("camera");
  if (const auto error = reader.error()) (void)slsd::to_line(slsd::error_message(nullptr, *error));
}

void read_request(std::string_view line) {
  const auto request = slsd::parse_request(line);
  if (request) return read_params(request->params);
  (void)slsd::to_line(slsd::error_message(request.error().id, request.error().error));
}

}  // namespace

// Any bytes in pieces of any size are requests, or errors that can be sent. The first byte is the pieces' size.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  const std::size_t piece = 1 + bytes[0];
  slsd::LineBuffer lines(4096);
  for (std::size_t at = 1; at < size && !lines.overflown(); at += piece) {
    lines.append({reinterpret_cast<const char*>(bytes) + at, std::min(piece, size - at)});
    while (const auto line = lines.next_line()) read_request(*line);
  }
  if (const auto rest = lines.rest()) read_request(*rest);
  return 0;
}
