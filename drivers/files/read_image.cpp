// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/files/read_image.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "drivers/files/file.hpp"
#include "drivers/files/image_formats.hpp"

namespace slsd {
namespace {

/// Identifies the format by the first bytes, not by the name, because people rename files.
Result<DecodedImage> decode(std::string_view bytes, std::size_t limit_bytes, KeepColours keep) {
  using namespace std::string_view_literals;
  if (bytes.empty()) return fail(ErrorCode::kMalformed, "the image file is empty; record or copy it again");
  if (bytes.starts_with("\x89PNG\r\n\x1a\n"sv)) return decode_png(bytes, limit_bytes, keep);
  for (const auto mark : {"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv})
    if (bytes.starts_with(mark)) return decode_tiff(bytes, limit_bytes, keep);
  if (bytes.starts_with("\xFF\xD8\xFF"sv)) return decode_jpeg(bytes, limit_bytes, keep);
  if (bytes.size() >= 3 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '7')
    return decode_pnm(bytes, limit_bytes, keep);
  return fail(ErrorCode::kUnsupported, "is not a PNG, TIFF, PGM, PPM or JPEG image; convert it to one of these");
}

bool is_mosaic(const DecodedImage& image, BayerPattern bayer) {
  return bayer != BayerPattern::kNone && !image.colour;
}

Result<GreyImage> grey_from(DecodedImage image, BayerPattern bayer) {
  if (!is_mosaic(image, bayer)) return std::move(image.grey);
  return std::visit([](const auto& mosaic) { return GreyImage(grey_from_mosaic(mosaic)); }, image.grey);
}

Result<DecodedImage> decode_at_no_place(std::string_view bytes, const ReadImageOptions& options, KeepColours keep) {
  if (bytes.size() > options.limit_file_bytes)
    return fail(ErrorCode::kInvalidArgument, "the image file is too large; save it smaller");
  auto image = decode(bytes, options.limit_decoded_bytes, keep);
  if (!image || !is_mosaic(*image, options.bayer)) return image;
  const auto [width, height] = size_of(view(image->grey));
  if (std::min(width, height) < 2)
    return fail(ErrorCode::kMismatch, "a Bayer mosaic has at least 2x2 pixels; set bayer to none for this image");
  return image;
}

Error at_place(Error error, std::string_view name) {
  error.where = name;
  return error;
}

}  // namespace

Result<GreyImage> decode_image(std::string_view bytes, std::string_view name, const ReadImageOptions& options) {
  auto image = decode_at_no_place(bytes, options, KeepColours::kNo);
  if (!image) return tl::unexpected(at_place(std::move(image.error()), name));
  return grey_from(std::move(*image), options.bayer);
}

Result<ColourFrame> read_colours(const std::filesystem::path& path, const ReadImageOptions& options) {
  const auto bytes = read_file(path, options.limit_file_bytes);
  if (!bytes) return tl::unexpected(bytes.error());
  auto image = decode_at_no_place(*bytes, options, KeepColours::kYes);
  if (!image) return tl::unexpected(at_place(std::move(image.error()), path.string()));
  return is_mosaic(*image, options.bayer) ? colours_from_mosaic(view(image->grey), options.bayer)
                                          : std::move(image->colours);
}

Result<GreyImage> read_image(const std::filesystem::path& path, const ReadImageOptions& options) {
  const auto bytes = read_file(path, options.limit_file_bytes);
  if (!bytes) return tl::unexpected(bytes.error());
  return decode_image(*bytes, path.string(), options);
}

}  // namespace slsd
