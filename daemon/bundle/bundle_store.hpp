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

/// The bundles that the service writes by itself: one to each way in which scans fail,
/// "20260131T120000Z-frame_torn-left.tar". The folder itself is the memory of what is not new: as long as the bundle of
/// a way is there, no other is written.
/// @thread thread-safe
class BundleStore {
 public:
  static constexpr std::size_t kFilesMax = 8;
  static constexpr std::chrono::minutes kPause{10};  ///< between two, whatever fails

  /// @param folder     made where it is missing; empty: nothing is ever written
  /// @param bytes_max  of all together; 0: nothing is ever written
  BundleStore(std::filesystem::path folder, std::size_t bytes_max)
      : folder_(std::move(folder)), bytes_max_(bytes_max) {}

  /// Tells whether this error is to be bundled: the client did not cause it, it is new, and the last bundle is old
  /// enough. A caller that gets true has to call put().
  [[nodiscard]] bool claim(const Error& error, std::chrono::system_clock::time_point now);
  /// Writes it, whole or not at all, and removes the oldest of those beyond the bounds.
  /// @errors kNoSpace: it alone is larger than all may be; those of write_file_atomically()
  [[nodiscard]] Result<std::filesystem::path> put(const Error& error, std::string_view bundle,
                                                  std::chrono::system_clock::time_point now);

  [[nodiscard]] std::uint64_t written() const;

 private:
  const std::filesystem::path folder_;
  const std::size_t bytes_max_;
  mutable std::mutex mutex_;
  std::set<std::string> claimed_;  // ways of this run: where a bundle cannot be written it is not tried for ever
  std::optional<std::chrono::system_clock::time_point> last_;
  std::uint64_t written_ = 0;
};

}  // namespace slsd
