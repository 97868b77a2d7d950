// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <netinet/in.h>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace slsd {

// The few messages of the GigE Vision Control Protocol that are needed before Aravis opens a device.

inline constexpr std::uint16_t kGvcpPort = 3956;

/// A GigE Vision device that answered, and the host interface that it answered through.
struct GigeDevice {
  std::string address;    ///< IPv4
  std::string interface;  ///< IPv4 address of this host
  std::string vendor;     ///< like the next field, printable whatever the device sent
  std::string model;
  std::string serial;

  /// "vendor-serial"
  [[nodiscard]] std::string name() const { return vendor + "-" + serial; }
};

/// The query for a device's identity.
/// @param id  of this query, not 0
[[nodiscard]] std::array<std::uint8_t, 8> gvcp_discovery(std::uint16_t id);
/// Reads the answer, without the addresses. Empty if the bytes are something else, or answer another query.
[[nodiscard]] std::optional<GigeDevice> read_gvcp_discovery(std::span<const std::uint8_t> answer, std::uint16_t id);

/// The query for a register's value.
/// @param id  of this query, not 0
[[nodiscard]] std::array<std::uint8_t, 12> gvcp_read(std::uint32_t address, std::uint16_t id);
/// Reads the value in the answer. Empty if the bytes are something else, or answer another query.
[[nodiscard]] std::optional<std::uint32_t> read_gvcp_value(std::span<const std::uint8_t> answer, std::uint16_t id);

/// The addressees of an action: devices with this device key, this group key, and a common bit in the mask.
struct ActionKeys {
  std::uint32_t device_key = 1;
  std::uint32_t group_key = 1;
  std::uint32_t group_mask = 1;

  friend bool operator==(const ActionKeys&, const ActionKeys&) = default;
};

/// The action command, which needs no answer.
/// @param ticks  device time of the action in ticks; nothing: at once
[[nodiscard]] std::vector<std::uint8_t> gvcp_action(const ActionKeys& keys, std::optional<std::uint64_t> ticks);

}  // namespace slsd
