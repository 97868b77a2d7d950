// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>

#include "core/cloud/pcd.hpp"
#include "core/cloud/ply.hpp"

namespace slsd {

enum class CloudFormat { kPly, kPcd };

[[nodiscard]] inline std::string_view to_string(CloudFormat format) {
  return format == CloudFormat::kPly ? "ply" : "pcd";
}
[[nodiscard]] inline CloudFormat cloud_format(std::string_view name) {
  return name == "pcd" ? CloudFormat::kPcd : CloudFormat::kPly;
}
[[nodiscard]] inline std::string write_cloud(const Cloud& cloud, CloudFormat format) {
  return format == CloudFormat::kPly ? write_ply(cloud) : write_pcd(cloud);
}

}  // namespace slsd
