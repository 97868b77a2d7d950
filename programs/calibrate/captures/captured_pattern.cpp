// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/captures/captured_pattern.hpp"

#include <algorithm>

#include "daemon/scan/scan_setup.hpp"
#include "drivers/files/file.hpp"

namespace slsd {
namespace {

constexpr std::size_t kMaxPatternBytes = 1 << 22;

}  // namespace

Result<Pattern> captured_pattern(const std::filesystem::path& folder, const Configuration& configuration) {
  const std::filesystem::path recorded = folder / "pattern.toml";
  std::error_code ignored;
  if (!std::filesystem::exists(recorded, ignored)) return configured_pattern(configuration);
  const auto text = read_file(recorded, kMaxPatternBytes);
  if (!text) return tl::unexpected(text.error());
  return read_pattern(*text, recorded.string());
}

bool captured_in_gray(const std::vector<CapturedPose>& poses) {
  return std::ranges::none_of(poses, [](const CapturedPose& pose) {
    return std::ranges::any_of(pose.cameras, [](const auto& files) { return !files.second.pattern.empty(); });
  });
}

}  // namespace slsd
