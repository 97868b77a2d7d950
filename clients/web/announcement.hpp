// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace slsd::web {

/// The page's address in a file that only its user and root may read, for `slsd-web --address`. The file is locked
/// while the program runs; that distinguishes it from files of earlier runs.
class Announcement {
 public:
  /// @errors kIo: the folder exists, but the file cannot be written
  [[nodiscard]] static Result<Announcement> write(int port, const std::string& address);
  Announcement(Announcement&& other) noexcept;
  Announcement(const Announcement&) = delete;
  Announcement& operator=(const Announcement&) = delete;
  ~Announcement() { remove(); }
  void remove();

 private:
  Announcement(std::filesystem::path file, int descriptor) : file_(std::move(file)), descriptor_(descriptor) {}

  std::filesystem::path file_;
  int descriptor_ = -1;
};

/// The addresses of the pages that this user may open. @errors kNotFound: none, with the remedy
[[nodiscard]] Result<std::vector<std::string>> announced_addresses();

}  // namespace slsd::web
