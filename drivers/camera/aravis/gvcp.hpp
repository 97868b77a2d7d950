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

// The few messages of the GigE Vision Control Protocol that are needed before Aravis has opened a device.

inline constexpr std::uint16_t kGvcpPort = 3956;

/// A GigE Vision device that answered, and through which of this host's interfaces.
struct GigeDevice {
  std::string address;    ///< IPv4
  std::string interface;  ///< IPv4 address of this host
  std::string vendor;     ///< this and the next printable, whatever the device sent
  std::string model;
  std::string serial;

  /// "vendor-serial"
  [[nodiscard]] std::string name() const { return vendor + "-" + serial; }
};

/// The question who a device is.
/// @param id  of this question, any but 0
[[nodiscard]] std::array<std::uint8_t, 8> gvcp_discovery(std::uint16_t id);
/// Reads the answer, without the addresses. Empty if the bytes are something else, or answer another question.
[[nodiscard]] std::optional<GigeDevice> read_gvcp_discovery(std::span<const std::uint8_t> answer, std::uint16_t id);

/// The question for a register's value.
/// @param id  of this question, any but 0
[[nodiscard]] std::array<std::uint8_t, 12> gvcp_read(std::uint32_t address, std::uint16_t id);
/// Reads the value in the answer. Empty if the bytes are something else, or answer another question.
[[nodiscard]] std::optional<std::uint32_t> read_gvcp_value(std::span<const std::uint8_t> answer, std::uint16_t id);

/// The addressees of an action: devices with the device key and the group key, and a bit of the mask in common.
struct ActionKeys {
  std::uint32_t device_key = 1;
  std::uint32_t group_key = 1;
  std::uint32_t group_mask = 1;

  friend bool operator==(const ActionKeys&, const ActionKeys&) = default;
};

/// The command to act, which wants no answer.
/// @param ticks  of the device's clock, when to act; nothing: at once
[[nodiscard]] std::vector<std::uint8_t> gvcp_action(const ActionKeys& keys, std::optional<std::uint64_t> ticks);

}  // namespace slsd
