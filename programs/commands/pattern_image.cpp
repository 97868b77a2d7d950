// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/pattern.hpp"
#include "daemon/scan/scan_setup.hpp"
#include "drivers/files/encode_png.hpp"
#include "drivers/files/file.hpp"
#include "programs/commands/commands.hpp"

namespace slsd {

Result<> write_pattern_image(const std::optional<std::filesystem::path>& configuration_file,
                             const std::filesystem::path& image) {
  if (const std::string extension = lower_extension(image); !extension.empty() && extension != ".png")
    return fail(ErrorCode::kInvalidArgument, "the file of the pattern must end in .png", image.string());
  const auto configuration = load_configuration_or_defaults(configuration_file);
  if (!configuration) return tl::unexpected(configuration.error());
  const auto pattern = configured_pattern(*configuration);
  if (!pattern) return tl::unexpected(pattern.error());
  const auto png = encode_png(draw_pattern(*pattern));
  if (!png) return tl::unexpected(png.error());
  return write_file_atomically(image, *png);
}

}  // namespace slsd
