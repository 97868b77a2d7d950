// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>

#include <asio/ip/address.hpp>

#include "core/result.hpp"

namespace slsd::tcp {

/// An IP address, or all that begin with the same bits: 192.168.1.20, 192.168.1.0/24, fd00::/8.
/// @thread reentrant
class AddressRange {
 public:
  /// @errors kInvalidArgument: not an address, or a wrong number of bits
  [[nodiscard]] static Result<AddressRange> parse(std::string_view text);

  /// An IPv4 address that came over IPv6 counts as the IPv4 address that it is.
  [[nodiscard]] bool contains(const asio::ip::address& address) const;

 private:
  AddressRange(const asio::ip::address_v6::bytes_type& bytes, int bits) : bytes_(bytes), bits_(bits) {}
  asio::ip::address_v6::bytes_type bytes_;  ///< IPv4 as ::ffff:a.b.c.d
  int bits_;                                ///< of the 128 that count
};

/// The address as people write it: IPv4 that came over IPv6 as IPv4.
[[nodiscard]] std::string text_of(const asio::ip::address& address);

}  // namespace slsd::tcp
