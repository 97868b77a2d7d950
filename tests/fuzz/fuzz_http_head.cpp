// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "clients/web/request.hpp"

// Any bytes are a head, the beginning of one, or refused; a head has no bare line end and ends in an empty line, and
// what is found to be a head is found again without what follows it.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view received(reinterpret_cast<const char*>(bytes), size);
  const slsd::web::HeadEnd end = slsd::web::find_head_end(received);
  if (end.refusal || end.bytes == 0) return 0;
  const std::string_view head = received.substr(0, end.bytes);
  if (!head.ends_with("\r\n\r\n") || slsd::web::find_head_end(head).bytes != end.bytes) std::abort();
  const auto request = slsd::web::read_head(head);
  if (request && (request->host.empty() || !request->path.starts_with('/'))) std::abort();
  if (request && request->body_bytes > 0 && (request->method == "GET" || request->method == "HEAD")) std::abort();
  return 0;
}
