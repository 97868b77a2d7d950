// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <filesystem>
#include <string_view>

#include "core/colour.hpp"
#include "core/result.hpp"
#include "drivers/files/bayer.hpp"
#include "drivers/files/grey_image.hpp"

namespace slsd {

/// The options for reading an image file, and the limits of its cost.
struct ReadImageOptions {
  BayerPattern bayer = BayerPattern::kNone;    ///< meaning of a grey image's pixels; colour images ignore it
  std::size_t limit_file_bytes = 1u << 28;     ///< 256 MiB
  std::size_t limit_decoded_bytes = 1u << 28;  ///< 256 MiB of pixels, as the file's header declares them
};

/// Decodes a PNG, TIFF, PGM, PPM or JPEG file into grey. Colour becomes 0.299 R + 0.587 G + 0.114 B (ITU-R
/// BT.601); transparency is ignored. Values are kept: 10 bits in a 16-bit file stay below 1024. PGM and PPM give their
/// greatest value, and are scaled to the full range. A file that ends early is an error, not a partial image.
/// @param name  the name of the bytes in errors
/// @errors kMalformed (empty, cut short, damaged), kUnsupported (another format, or a rare variant), kInvalidArgument
///         (larger than the limits)
/// @thread reentrant
[[nodiscard]] Result<GreyImage> decode_image(std::string_view bytes, std::string_view name,
                                             const ReadImageOptions& options = {});

/// Reads the colours of an image file: its own, or those of a Bayer mosaic. Empty if it is grey.
/// @errors as read_image()
/// @thread reentrant
[[nodiscard]] Result<ColourFrame> read_colours(const std::filesystem::path& path, const ReadImageOptions& options = {});

/// Reads an image file. @errors as read_file() and decode_image() @thread reentrant
[[nodiscard]] Result<GreyImage> read_image(const std::filesystem::path& path, const ReadImageOptions& options = {});

}  // namespace slsd
