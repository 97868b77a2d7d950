// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/v4l2/encode_frame.hpp"

#include <linux/videodev2.h>

#include <opencv2/imgcodecs.hpp>

#include <cstring>

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

// With chroma, as cameras make it.
std::size_t encode_jpeg(const Grey8& image, std::vector<std::byte>& bytes) {
  cv::Mat colour(image.height(), image.width(), CV_8UC3);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) colour.at<cv::Vec3b>(y, x) = cv::Vec3b::all(image.row(y)[x]);
  }
  std::vector<unsigned char> jpeg;
  cv::imencode(".jpg", colour, jpeg, {cv::IMWRITE_JPEG_QUALITY, 90});
  if (jpeg.size() > bytes.size()) return 0;
  std::memcpy(bytes.data(), jpeg.data(), jpeg.size());
  return jpeg.size();
}

}  // namespace

int row_bytes_of(std::uint32_t fourcc, int width) {
  if (fourcc == V4L2_PIX_FMT_MJPEG) return 0;
  const bool two = shift_of(fourcc) > 0 || fourcc == V4L2_PIX_FMT_YUYV || fourcc == V4L2_PIX_FMT_UYVY;
  return two ? 2 * width : width;
}

std::size_t frame_bytes_of(std::uint32_t fourcc, int width, int height, int padding_bytes) {
  if (fourcc == V4L2_PIX_FMT_MJPEG) return static_cast<std::size_t>(width) * height * 2;
  return static_cast<std::size_t>(row_bytes_of(fourcc, width) + padding_bytes) * height;
}

std::size_t encode_frame(const Grey8& image, std::uint32_t fourcc, int padding_bytes, std::vector<std::byte>& bytes) {
  if (fourcc == V4L2_PIX_FMT_MJPEG) return encode_jpeg(image, bytes);
  const auto stride = static_cast<std::size_t>(row_bytes_of(fourcc, image.width()) + padding_bytes);
  for (int y = 0; y < image.height(); ++y) encode_row(image.row(y), image.width(), fourcc, bytes.data() + y * stride);
  return stride * image.height();
}

}  // namespace slsd::test
