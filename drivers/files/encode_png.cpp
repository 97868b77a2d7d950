// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/files/encode_png.hpp"

#include <cstdint>
#include <exception>
#include <utility>
#include <variant>
#include <vector>

#include <opencv2/imgcodecs.hpp>

namespace slsd {
namespace {

tl::unexpected<Error> fail_empty() {
  return fail(ErrorCode::kInvalidArgument, "an image without pixels has no PNG");
}

Result<std::string> encode(const cv::Mat& image) {
  try {
    std::vector<std::uint8_t> bytes;
    if (cv::imencode(".png", image, bytes)) return std::string(bytes.begin(), bytes.end());
    return fail(ErrorCode::kIo, "the image could not be turned into PNG");
  } catch (const std::exception& exception) {
    return fail(ErrorCode::kIo, std::string("the image could not be turned into PNG: ") + exception.what());
  }
}

template <class T>
Result<std::string> encode_grey(const ImageView<T>& image) {
  if (image.width <= 0 || image.height <= 0) return fail_empty();
  constexpr int kType = sizeof(T) == 1 ? CV_8UC1 : CV_16UC1;
  return encode(cv::Mat(image.height, image.width, kType, const_cast<T*>(image.pixels),
                        static_cast<std::size_t>(image.stride) * sizeof(T)));
}

}  // namespace

Result<std::string> encode_png(const Grey8& image) {
  return encode_grey(image.view());
}
Result<std::string> encode_png(const Grey16& image) {
  return encode_grey(image.view());
}

Result<std::string> encode_png(const GreyView& image) {
  return std::visit([](const auto& pixels) { return encode_grey(pixels); }, image);
}

Result<std::string> encode_png(const ColourImage& image) {
  if (image.empty()) return fail_empty();
  cv::Mat blue_first(image.height(), image.width(), CV_8UC3);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) {
      const Rgb& pixel = image.at(x, y);
      blue_first.at<cv::Vec3b>(y, x) = {pixel[2], pixel[1], pixel[0]};
    }
  return encode(blue_first);
}

}  // namespace slsd
