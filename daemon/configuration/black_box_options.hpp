// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <filesystem>

#include "core/result.hpp"

namespace slsd {

/// The [black_box] table: what the service keeps of the last scans.
struct BlackBoxOptions {
  int memory_max_mb = 16;        ///< 0 to 512, for frames and points; 0: keeps nothing
  int disk_max_mb = 64;          ///< 0 to 65536, for bundles that the service writes on its own; 0: writes none
  std::filesystem::path folder;  ///< the bundles' folder; empty: the folder "bundles" of systemd's StateDirectory=

  [[nodiscard]] std::size_t memory_max_bytes() const { return static_cast<std::size_t>(memory_max_mb) << 20U; }
  [[nodiscard]] std::size_t disk_max_bytes() const { return static_cast<std::size_t>(disk_max_mb) << 20U; }
  /// The folder in effect; empty: none. Reads the environment.
  [[nodiscard]] std::filesystem::path bundles() const;
  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const BlackBoxOptions&, const BlackBoxOptions&) = default;
};

}  // namespace slsd
