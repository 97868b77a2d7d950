// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/files/image_header.hpp"

#include <string>

namespace slsd {

Result<ImageHeader> read_image_header(std::string_view bytes) {
  using namespace std::string_view_literals;
  if (bytes.empty()) return fail(ErrorCode::kMalformed, "the image file is empty; record or copy it again");
  if (bytes.starts_with("\x89PNG\r\n\x1a\n"sv)) return read_png_header(bytes);
  if (bytes.starts_with("II*\0"sv) || bytes.starts_with("MM\0*"sv)) return read_tiff_header(bytes);
  if (bytes.starts_with("BM"sv)) return read_bmp_header(bytes);
  if (bytes.size() >= 3 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '7') return read_pnm_header(bytes);
  return fail(ErrorCode::kUnsupported, "is not a PNG, TIFF, PGM, PPM or BMP image; convert it to one of these");
}

tl::unexpected<Error> fail_truncated(std::string_view format) {
  return fail(ErrorCode::kMalformed,
              "the " + std::string(format) + " image ends early or is damaged; record or copy it again");
}

tl::unexpected<Error> fail_variant(std::string_view format, std::string_view what) {
  return fail(ErrorCode::kUnsupported, "a " + std::string(format) + " image with " + std::string(what) +
                                           " is not read; save it as PNG, 8 or 16 bits, grey or RGB");
}

}  // namespace slsd
