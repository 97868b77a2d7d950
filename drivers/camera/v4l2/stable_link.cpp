// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/stable_link.hpp"

#include "drivers/camera/listing/sysfs.hpp"

namespace slsd {

using std::filesystem::path;

std::optional<path> find_stable_link(const path& node, const path& devices) {
  const path links = devices / "v4l/by-id";
  if (node.parent_path() == links) return node;
  std::error_code error;
  for (const path& link : entries_of(links))
    if (std::filesystem::equivalent(link, node, error)) return link;
  return std::nullopt;
}

}  // namespace slsd
