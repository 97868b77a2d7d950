// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <mutex>

namespace slsd {

/// To be held wherever Aravis reads a device's description, for the device or for its chunk data: Aravis 0.8 keeps the
/// state of its parser, one for the whole process, where no lock protects it.
/// @thread thread-safe
[[nodiscard]] inline std::unique_lock<std::mutex> lock_descriptions() {
  static std::mutex mutex;
  return std::unique_lock(mutex);
}

}  // namespace slsd
