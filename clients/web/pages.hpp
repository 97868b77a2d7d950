// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <string_view>

namespace slsd::web {

/// A file of the folder page/, embedded in the program: requests cannot name other paths.
struct Page {
  std::string_view path;
  std::string_view type;
  std::string_view text;
};

[[nodiscard]] std::span<const Page> pages();

}  // namespace slsd::web
