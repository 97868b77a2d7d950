// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>

namespace slsd {

/// The link of v4l/by-id that leads to a device node, which is the same wherever the camera is plugged in.
/// @param node     by any of its names
/// @param devices  "/dev"
/// @return nothing where there is none
/// @thread reentrant
[[nodiscard]] std::optional<std::filesystem::path> find_stable_link(const std::filesystem::path& node,
                                                                    const std::filesystem::path& devices);

}  // namespace slsd
