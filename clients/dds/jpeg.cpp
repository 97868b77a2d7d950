// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include <jpeglib.h>

#include "messages.hpp"

namespace slsd::dds {
namespace {

constexpr int kQuality = 90;

struct Failure {
  jpeg_error_mgr errors;
  std::jmp_buf back;
};

[[noreturn]] void leave(j_common_ptr codec) {
  std::longjmp(reinterpret_cast<Failure*>(codec->err)->back, 1);
}

/// Memory that libjpeg allocates; the caller frees it, however encode() ends.
struct Encoded {
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  ~Encoded() { std::free(bytes); }
};

// Holds nothing with a destructor, because libjpeg leaves by a jump.
bool encode(const std::uint8_t* pixels, int width_px, int height_px, Encoded& to) {
  jpeg_compress_struct codec;
  Failure failure;
  codec.err = ::jpeg_std_error(&failure.errors);
  failure.errors.error_exit = leave;
  jpeg_create_compress(&codec);
  if (setjmp(failure.back)) return ::jpeg_destroy_compress(&codec), false;
  ::jpeg_mem_dest(&codec, &to.bytes, &to.size);
  codec.image_width = static_cast<JDIMENSION>(width_px);
  codec.image_height = static_cast<JDIMENSION>(height_px);
  codec.input_components = 1;
  codec.in_color_space = JCS_GRAYSCALE;
  ::jpeg_set_defaults(&codec);
  ::jpeg_set_quality(&codec, kQuality, TRUE);
  ::jpeg_start_compress(&codec, TRUE);
  while (codec.next_scanline < codec.image_height) {
    JSAMPROW row = const_cast<JSAMPROW>(pixels) + static_cast<std::size_t>(codec.next_scanline) * codec.image_width;
    ::jpeg_write_scanlines(&codec, &row, 1);
  }
  ::jpeg_finish_compress(&codec);
  ::jpeg_destroy_compress(&codec);
  return true;
}

}  // namespace

Result<ros::CompressedImage> compressed_image(const client::Frame& frame, const ros::Header& header) {
  std::vector<std::uint8_t> pixels;
  pixels.reserve(static_cast<std::size_t>(frame.width_px) * static_cast<std::size_t>(frame.height_px));
  for (int v = 0; v < frame.height_px; ++v)
    for (int u = 0; u < frame.width_px; ++u)
      pixels.push_back(static_cast<std::uint8_t>(frame.bits > 8 ? frame.at(u, v) >> (frame.bits - 8) : frame.at(u, v)));
  Encoded encoded;
  if (!encode(pixels.data(), frame.width_px, frame.height_px, encoded))
    return fail(ErrorCode::kIo, "a frame cannot be compressed to JPEG");
  return ros::CompressedImage{header, "mono8; jpeg compressed mono8", {encoded.bytes, encoded.bytes + encoded.size}};
}

}  // namespace slsd::dds
