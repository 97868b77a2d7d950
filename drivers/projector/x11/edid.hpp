// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace slsd {

/// The identity that a monitor reports.
struct EdidIdentity {
  std::string model;   ///< its name, else maker and product number; empty: unknown
  std::string serial;  ///< text if the monitor has one, else a number; empty: none
};

/// Reads the first block of a monitor's EDID (VESA E-EDID 1.4). Other bytes give an empty identity.
/// @thread reentrant
[[nodiscard]] EdidIdentity read_edid(std::span<const std::uint8_t> bytes);

}  // namespace slsd
