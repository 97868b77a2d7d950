// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/v4l2/encode_frame.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <cstdio>
#include <cstring>

#include <jpeglib.h>

namespace slsd::test {
namespace {

// How far the grey is shifted in two bytes; nothing in one.
int shift_of(std::uint32_t fourcc) {
  switch (fourcc) {
    case V4L2_PIX_FMT_Y10:
    case V4L2_PIX_FMT_SRGGB10:
      return 2;
    case V4L2_PIX_FMT_Y12:
    case V4L2_PIX_FMT_SRGGB12:
      return 4;
    case V4L2_PIX_FMT_Y16:
    case V4L2_PIX_FMT_SRGGB16:
      return 8;
    default:
      return 0;
  }
}

bool has_planes(std::uint32_t fourcc) {
  return fourcc == V4L2_PIX_FMT_NV12 || fourcc == V4L2_PIX_FMT_YUV420;
}

void encode_row(const std::uint8_t* from, int width, std::uint32_t fourcc, std::byte* to) {
  const int shift = shift_of(fourcc);
  for (int x = 0; x < width; ++x) {
    if (shift > 0) {
      const auto wide = static_cast<std::uint16_t>(from[x] << shift);
      std::memcpy(to + 2 * x, &wide, sizeof wide);
    } else if (fourcc == V4L2_PIX_FMT_YUYV || fourcc == V4L2_PIX_FMT_UYVY) {
      const int luma = fourcc == V4L2_PIX_FMT_YUYV ? 0 : 1;
      to[2 * x + luma] = std::byte{from[x]};
      to[2 * x + 1 - luma] = std::byte{128};
    } else {
      to[x] = std::byte{from[x]};
    }
  }
}

void write_rows(const Grey8& image, jpeg_compress_struct& encoder) {
  std::vector<JSAMPLE> row(std::size_t{3} * image.width());
  for (int y = 0; y < image.height(); ++y) {
    for (std::size_t i = 0; i < row.size(); ++i) row[i] = image.row(y)[i / 3];
    JSAMPROW rows = row.data();
    jpeg_write_scanlines(&encoder, &rows, 1);
  }
}

// With chroma, as cameras make it. The buffer holds the image raw, which is always longer.
std::size_t encode_jpeg(const Grey8& image, std::vector<std::byte>& bytes) {
  jpeg_compress_struct encoder{};
  jpeg_error_mgr errors{};
  encoder.err = jpeg_std_error(&errors);
  jpeg_create_compress(&encoder);
  auto* memory = reinterpret_cast<unsigned char*>(bytes.data());
  unsigned long used = bytes.size();
  jpeg_mem_dest(&encoder, &memory, &used);
  encoder.image_width = static_cast<JDIMENSION>(image.width());
  encoder.image_height = static_cast<JDIMENSION>(image.height());
  encoder.input_components = 3;
  encoder.in_color_space = JCS_RGB;
  jpeg_set_defaults(&encoder);
  jpeg_set_quality(&encoder, 90, TRUE);
  jpeg_start_compress(&encoder, TRUE);
  write_rows(image, encoder);
  jpeg_finish_compress(&encoder);
  jpeg_destroy_compress(&encoder);
  return used;
}

}  // namespace

int row_bytes_of(std::uint32_t fourcc, int width) {
  if (fourcc == V4L2_PIX_FMT_MJPEG) return 0;
  const bool two = shift_of(fourcc) > 0 || fourcc == V4L2_PIX_FMT_YUYV || fourcc == V4L2_PIX_FMT_UYVY;
  return two ? 2 * width : width;
}

std::size_t frame_bytes_of(std::uint32_t fourcc, int width, int height, int padding_bytes) {
  if (fourcc == V4L2_PIX_FMT_MJPEG) return static_cast<std::size_t>(width) * height * 2;
  const std::size_t luma = static_cast<std::size_t>(row_bytes_of(fourcc, width) + padding_bytes) * height;
  return has_planes(fourcc) ? luma + luma / 2 : luma;
}

std::size_t encode_frame(const Grey8& image, std::uint32_t fourcc, int padding_bytes, std::vector<std::byte>& bytes) {
  if (fourcc == V4L2_PIX_FMT_MJPEG) return encode_jpeg(image, bytes);
  const auto stride = static_cast<std::size_t>(row_bytes_of(fourcc, image.width()) + padding_bytes);
  for (int y = 0; y < image.height(); ++y) encode_row(image.row(y), image.width(), fourcc, bytes.data() + y * stride);
  const std::size_t luma = stride * image.height();
  if (!has_planes(fourcc)) return luma;
  std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(luma), luma / 2, std::byte{128});
  return luma + luma / 2;
}

}  // namespace slsd::test
