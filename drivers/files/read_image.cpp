// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/files/read_image.hpp"

#include <algorithm>
#include <cstdint>
#include <exception>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include <opencv2/imgcodecs.hpp>

#include "drivers/files/file.hpp"
#include "drivers/files/image_header.hpp"

namespace slsd {
namespace {

// OpenCV's weights of ITU-R BT.601, in 1 / 2^15.
constexpr std::uint32_t kBlue = 3735;
constexpr std::uint32_t kGreen = 19235;
constexpr std::uint32_t kRed = 9798;

template <class T>
void copy_grey(const T* from, T* to, int width) {
  std::copy_n(from, width, to);
}

template <class T>
void weigh_colours(const T* from, int channels, T* to, int width) {
  for (int x = 0; x < width; ++x, from += channels)
    to[x] = static_cast<T>((kBlue * from[0] + kGreen * from[1] + kRed * from[2] + (1u << 14)) >> 15);
}

template <class T>
Image<T> grey_from(const cv::Mat& decoded, BayerPattern bayer) {
  Image<T> grey(decoded.cols, decoded.rows);
  for (int y = 0; y < decoded.rows; ++y) {
    if (decoded.channels() == 1)
      copy_grey(decoded.ptr<T>(y), grey.row(y), decoded.cols);
    else
      weigh_colours(decoded.ptr<T>(y), decoded.channels(), grey.row(y), decoded.cols);
  }
  return bayer != BayerPattern::kNone && decoded.channels() == 1 ? grey_from_mosaic(grey) : grey;
}

/// Nothing where OpenCV cannot.
std::optional<cv::Mat> decode(std::string_view bytes) {
  try {
    const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data()));
    cv::Mat decoded = cv::imdecode(buffer, cv::IMREAD_UNCHANGED);
    const int channels = decoded.channels();
    if (decoded.empty() || (decoded.depth() != CV_8U && decoded.depth() != CV_16U) || channels == 2 || channels > 4)
      return std::nullopt;
    return decoded;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

Result<> check_limits(const ImageHeader& header, const ReadImageOptions& options) {
  const double limit = static_cast<double>(options.limit_decoded_bytes);
  constexpr std::uint64_t kSideMax = 1u << 20;  // OpenCV's own
  if (header.decoded_bytes() <= limit && header.width_px <= kSideMax && header.height_px <= kSideMax) return {};
  return fail(ErrorCode::kInvalidArgument, "the image declares " + std::to_string(header.width_px) + "x" +
                                               std::to_string(header.height_px) +
                                               " pixels, more than are read; save it smaller");
}

Result<GreyImage> decode_at_no_place(std::string_view bytes, const ReadImageOptions& options) {
  if (bytes.size() > std::min<std::size_t>(options.limit_file_bytes, std::numeric_limits<int>::max()))
    return fail(ErrorCode::kInvalidArgument, "the image file is longer than is read; save it smaller");
  const auto header = read_image_header(bytes);
  if (!header) return tl::unexpected(header.error());
  if (auto within = check_limits(*header, options); !within) return tl::unexpected(within.error());
  const auto decoded = decode(bytes);
  if (!decoded || static_cast<std::uint64_t>(decoded->cols) != header->width_px ||
      static_cast<std::uint64_t>(decoded->rows) != header->height_px)
    return fail(ErrorCode::kMalformed, "the image is damaged; record or copy it again");
  if (options.bayer != BayerPattern::kNone && std::min(decoded->cols, decoded->rows) < 2)
    return fail(ErrorCode::kMismatch, "a Bayer mosaic has at least 2x2 pixels; set bayer to none for this image");
  if (decoded->depth() == CV_16U) return grey_from<std::uint16_t>(*decoded, options.bayer);
  return grey_from<std::uint8_t>(*decoded, options.bayer);
}

}  // namespace

GreyView view(const GreyImage& image) {
  return std::visit([](const auto& pixels) { return GreyView(pixels.view()); }, image);
}

Result<GreyImage> decode_image(std::string_view bytes, std::string_view name, const ReadImageOptions& options) {
  return decode_at_no_place(bytes, options).map_error([&](Error error) {
    error.where = name;
    return error;
  });
}

Result<GreyImage> read_image(const std::filesystem::path& path, const ReadImageOptions& options) {
  const auto bytes = read_file(path, options.limit_file_bytes);
  if (!bytes) return tl::unexpected(bytes.error());
  return decode_image(*bytes, path.string(), options);
}

}  // namespace slsd
