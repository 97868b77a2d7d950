// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/files/image_formats.hpp"

#include <string>

namespace slsd {
namespace {

// In units of 1 / 2^15.
constexpr std::uint32_t kRed = 9798;
constexpr std::uint32_t kGreen = 19235;
constexpr std::uint32_t kBlue = 3735;

constexpr std::uint64_t kSideMaxPx = 1u << 20;

template <class T>
void weigh(const T* samples, int channels, T* grey, int width_px) {
  for (int x = 0; x < width_px; ++x, samples += channels) {
    if (channels < 3)
      grey[x] = samples[0];
    else
      grey[x] = static_cast<T>((kRed * samples[0] + kGreen * samples[1] + kBlue * samples[2] + (1u << 14)) >> 15);
  }
}

}  // namespace

Result<> check_layout(std::string_view format, const ImageLayout& layout, std::size_t file_bytes,
                      double compression_max, std::size_t limit_bytes) {
  if (layout.width_px == 0 || layout.height_px == 0) return fail_truncated(format);
  if (layout.width_px > kSideMaxPx || layout.height_px > kSideMaxPx ||
      layout.bytes() > static_cast<double>(limit_bytes))
    return fail(ErrorCode::kInvalidArgument,
                "the " + std::string(format) + " image declares " + std::to_string(layout.width_px) + "x" +
                    std::to_string(layout.height_px) + " pixels, more than the limit; save it smaller");
  // Also prevents a small file from using much memory.
  if (layout.bytes() > compression_max * static_cast<double>(file_bytes)) return fail_truncated(format);
  return {};
}

void grey_row(const std::uint8_t* samples, int channels, std::uint8_t* grey, int width_px) {
  weigh(samples, channels, grey, width_px);
}

void grey_row(const std::uint16_t* samples, int channels, std::uint16_t* grey, int width_px) {
  weigh(samples, channels, grey, width_px);
}

tl::unexpected<Error> fail_truncated(std::string_view format) {
  return fail(ErrorCode::kMalformed,
              "the " + std::string(format) + " image ends early or is damaged; record or copy it again");
}

tl::unexpected<Error> fail_variant(std::string_view format, std::string_view what) {
  return fail(ErrorCode::kUnsupported, "a " + std::string(format) + " image with " + std::string(what) +
                                           " is not supported; save it as PNG, 8 or 16 bits, grey or RGB");
}

}  // namespace slsd
