// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <string_view>

namespace slsd::web {

/// A file of the folder page/, which is part of the program: nothing is looked up by a path that a request names.
struct Page {
  std::string_view path;
  std::string_view type;
  std::string_view text;
};

[[nodiscard]] std::span<const Page> pages();

}  // namespace slsd::web
