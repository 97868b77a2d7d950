// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/drivers/jpeg_bytes.hpp"

#include <cmath>
#include <cstdio>  // before jpeglib.h, which needs it
#include <cstdlib>
#include <random>
#include <stdexcept>
#include <vector>

#include <jpeglib.h>

namespace slsd::test {
namespace {

std::size_t segment_end(const std::string& jpeg, std::size_t at) {
  return at + 2 + 256 * static_cast<unsigned char>(jpeg[at + 2]) + static_cast<unsigned char>(jpeg[at + 3]);
}

}  // namespace

std::string jpeg_bytes(const Grey8& image, const JpegKind& kind) {
  jpeg_compress_struct encoder{};
  jpeg_error_mgr errors{};
  encoder.err = ::jpeg_std_error(&errors);
  ::jpeg_create_compress(&encoder);
  unsigned char* memory = nullptr;
  unsigned long size = 0;
  ::jpeg_mem_dest(&encoder, &memory, &size);
  encoder.image_width = static_cast<JDIMENSION>(image.width());
  encoder.image_height = static_cast<JDIMENSION>(image.height());
  encoder.input_components = kind.components;
  encoder.in_color_space = kind.components == 1 ? JCS_GRAYSCALE : kind.components == 3 ? JCS_RGB : JCS_CMYK;
  ::jpeg_set_defaults(&encoder);
  ::jpeg_set_quality(&encoder, kind.quality, TRUE);
  if (kind.progressive) ::jpeg_simple_progression(&encoder);
  encoder.arith_code = kind.arithmetic ? TRUE : FALSE;
  encoder.restart_interval = static_cast<unsigned>(kind.restart_interval);
  ::jpeg_start_compress(&encoder, TRUE);
  std::vector<JSAMPLE> row(static_cast<std::size_t>(kind.components) * image.width());
  for (int y = 0; y < image.height(); ++y) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      const int share = kind.components == 3 ? kind.shares[i % 3] : 255;
      row[i] = static_cast<JSAMPLE>(image.row(y)[i / kind.components] * share / 255);
    }
    JSAMPROW rows = row.data();
    ::jpeg_write_scanlines(&encoder, &rows, 1);
  }
  ::jpeg_finish_compress(&encoder);
  ::jpeg_destroy_compress(&encoder);
  std::string bytes(reinterpret_cast<const char*>(memory), size);
  std::free(memory);
  return bytes;
}

Grey8 busy_image(int width, int height) {
  Grey8 image(width, height);
  std::mt19937 random(1);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const bool lit = (x / 9 * 7 + y / 9 * 5) % 3 == 0 && (x % 9 - 4) * (x % 9 - 4) + (y % 9 - 4) * (y % 9 - 4) < 14;
      const double shade = 40 + 30 * std::sin(x / 90.0) * std::cos(y / 70.0);
      image.row(y)[x] = static_cast<std::uint8_t>(shade + (lit ? 110 : 0) + static_cast<double>(random() % 9));
    }
  return image;
}

std::size_t scan_begin(const std::string& jpeg) {
  for (std::size_t at = 2; at + 4 <= jpeg.size(); at = segment_end(jpeg, at))
    if (static_cast<unsigned char>(jpeg[at + 1]) == 0xda) return segment_end(jpeg, at);
  throw std::logic_error("a JPEG without a scan");
}

std::string without_segments(const std::string& jpeg, unsigned char marker) {
  std::string kept = jpeg.substr(0, 2);
  const std::size_t begin = scan_begin(jpeg);
  for (std::size_t at = 2; at < begin; at = segment_end(jpeg, at))
    if (static_cast<unsigned char>(jpeg[at + 1]) != marker) kept += jpeg.substr(at, segment_end(jpeg, at) - at);
  return kept + jpeg.substr(begin);
}

}  // namespace slsd::test
