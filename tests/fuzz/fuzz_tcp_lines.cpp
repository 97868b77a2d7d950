// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "clients/tcp/request_lines.hpp"

// Any bytes are a greeting or refused. What passes to the service is the same however the bytes come, asks for no
// memfd, and has as many lines as before; the last one is ended.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view received(reinterpret_cast<const char*>(bytes), size);
  const auto greeting = slsd::tcp::read_greeting(received.substr(0, received.find('\n')));
  if (!greeting && greeting.error().error.message.empty()) std::abort();
  slsd::tcp::RequestLines whole, pieces;
  whole.append(received);
  std::string passed = whole.take();
  passed += whole.take_rest();
  std::string joined;
  for (std::size_t at = 0; at < size; at += 7) {
    pieces.append(received.substr(at, 7));
    joined += pieces.take();
  }
  if (joined + pieces.take_rest() != passed) std::abort();
  std::size_t lines = 0;
  for (const char each : passed) lines += each == '\n';
  for (const char each : received) lines -= each == '\n';
  const bool was_ended = !received.ends_with('\n') && passed.ends_with('\n');
  if (lines != (was_ended ? 1 : 0)) std::abort();
  for (std::size_t begin = 0, end = 0; (end = passed.find('\n', begin)) != std::string::npos; begin = end + 1) {
    const auto request = slsd::parse_request(std::string_view(passed).substr(begin, end - begin));
    if (request && request->params.value("transport", nlohmann::json()) == "memfd") std::abort();
  }
  return 0;
}
