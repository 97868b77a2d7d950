// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <utility>

#include "drivers/files/image_formats.hpp"
#include "drivers/files/jpeg_decoder.hpp"

namespace slsd {
namespace {

tl::unexpected<Error> with_remedy(Error error) {
  if (error.code == ErrorCode::kMalformed) error.message += "; record or copy it again";
  return tl::unexpected(std::move(error));
}

}  // namespace

Result<DecodedImage> decode_jpeg(std::string_view bytes, std::size_t limit_bytes, KeepColours keep) {
  constexpr double kRatioMax = 1200;  // a block of 64 samples needs at least one bit
  JpegDecoder decoder(bytes);
  if (auto header = decoder.read_header(); !header) return with_remedy(std::move(header.error()));
  const ImageLayout layout{static_cast<std::uint64_t>(decoder.width_px()),
                           static_cast<std::uint64_t>(decoder.height_px()), decoder.colour() ? 3 : 1, 1};
  auto checked = check_layout("JPEG", layout, bytes.size(), kRatioMax, limit_bytes);
  if (!checked) return tl::unexpected(std::move(checked.error()));
  Grey8 grey(decoder.width_px(), decoder.height_px());
  if (auto read = decoder.read_grey(grey); !read) return with_remedy(std::move(read.error()));
  DecodedImage image{std::move(grey), decoder.colour()};
  if (!image.colour || keep == KeepColours::kNo) return image;
  JpegDecoder again(bytes);
  image.colours = ColourFrame(decoder.width_px(), decoder.height_px());
  auto read = again.read_header();
  if (read) read = again.read_colours(image.colours);
  if (!read) return with_remedy(std::move(read.error()));
  return image;
}

}  // namespace slsd
