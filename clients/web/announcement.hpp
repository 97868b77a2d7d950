// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace slsd::web {

/// The page's address in a file that its user and root may read, for `slsd-web --address`; locked while the program
/// runs, and so told from one that an earlier run left.
class Announcement {
 public:
  /// @errors kIo: there is a folder for it, but no file could be written
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

/// The addresses of the pages that this user may open. @errors kNotFound: none, with what to do
[[nodiscard]] Result<std::vector<std::string>> announced_addresses();

}  // namespace slsd::web
