// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace slsd {

/// The bundles that the service writes on its own: one for each kind of failure,
/// "20260131T120000Z-frame_torn-left.tar". The folder records the known kinds: as long as it contains a bundle of a
/// kind, no other is written.
/// @thread thread-safe
class BundleStore {
 public:
  static constexpr std::size_t kFilesMax = 8;
  static constexpr std::chrono::minutes kPause{10};  ///< between two bundles, whatever fails

  /// @param folder     created if missing; empty: no bundle is ever written
  /// @param bytes_max  limit of all bundles together; 0: no bundle is ever written
  BundleStore(std::filesystem::path folder, std::size_t bytes_max)
      : folder_(std::move(folder)), bytes_max_(bytes_max) {}

  /// Tells whether to bundle this error: the client did not cause it, its kind is new, and the last bundle is old
  /// enough. After true, the caller must call put().
  [[nodiscard]] bool claim(const Error& error, std::chrono::system_clock::time_point now);
  /// Writes the bundle, whole or not at all, and removes the oldest beyond the limits.
  /// @errors kNoSpace: the bundle alone exceeds the limit; those of write_file_atomically()
  [[nodiscard]] Result<std::filesystem::path> put(const Error& error, std::string_view bundle,
                                                  std::chrono::system_clock::time_point now);

  [[nodiscard]] std::uint64_t written() const;

 private:
  const std::filesystem::path folder_;
  const std::size_t bytes_max_;
  mutable std::mutex mutex_;
  std::set<std::string> claimed_;  // kinds in this run, so that a failing write is not repeated for ever
  std::optional<std::chrono::system_clock::time_point> last_;
  std::uint64_t written_ = 0;
};

}  // namespace slsd
