// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/tcp/address_range.hpp"

#include <charconv>

#include "core/printable.hpp"

namespace slsd::tcp {
namespace {

using asio::ip::address;
using asio::ip::address_v6;

constexpr int kBitsBeforeV4 = 96;

address_v6 as_v6(const address& any) {
  return any.is_v4() ? asio::ip::make_address_v6(asio::ip::v4_mapped, any.to_v4()) : any.to_v6();
}

}  // namespace

Result<AddressRange> AddressRange::parse(std::string_view text) {
  const auto refuse = [&](const char* why) {
    return fail(ErrorCode::kInvalidArgument, why, "\"" + printable(text, 200) + "\"");
  };
  const std::size_t slash = text.find('/');
  std::error_code error;
  const address base = asio::ip::make_address(std::string(text.substr(0, slash)), error);
  if (error) return refuse("not an IP address: write 192.168.1.20, 192.168.1.0/24 or fd00::1");
  const int most = base.is_v4() ? 32 : 128;
  int bits = most;
  if (slash != std::string_view::npos) {
    const std::string_view number = text.substr(slash + 1);
    const auto [end, failure] = std::from_chars(number.data(), number.data() + number.size(), bits);
    if (failure != std::errc() || end != number.data() + number.size() || bits < 0 || bits > most)
      return refuse(base.is_v4() ? "an IPv4 address has 0 to 32 bits" : "an IPv6 address has 0 to 128 bits");
  }
  return AddressRange(as_v6(base).to_bytes(), base.is_v4() ? bits + kBitsBeforeV4 : bits);
}

bool AddressRange::contains(const address& candidate) const {
  const auto bytes = as_v6(candidate).to_bytes();
  for (int bit = 0; bit < bits_; ++bit) {
    const auto at = static_cast<std::size_t>(bit / 8);
    if (((bytes[at] ^ bytes_[at]) & (0x80U >> static_cast<unsigned>(bit % 8))) != 0) return false;
  }
  return true;
}

std::string text_of(const address& any) {
  const bool mapped = any.is_v6() && any.to_v6().is_v4_mapped();
  return mapped ? asio::ip::make_address_v4(asio::ip::v4_mapped, any.to_v6()).to_string() : any.to_string();
}

}  // namespace slsd::tcp
