// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>

#include "core/colour.hpp"
#include "core/result.hpp"
#include "drivers/files/grey_image.hpp"

namespace slsd {

/// The image in a file's bytes. The errors below have no place, because the caller knows it.
struct DecodedImage {
  GreyImage grey;
  bool colour = false;       ///< the file had colours, so it is not a mosaic
  ColourFrame colours = {};  ///< if they are to be kept and the file has them
};

enum class KeepColours : bool { kNo, kYes };

/// One function for each format; the bytes begin with that format's signature. A file that ends early, or is visibly
/// damaged, is an error. The memory that its header requires is checked before allocation.
/// @param limit_bytes  of decoded samples
/// @errors kMalformed, kUnsupported, kInvalidArgument (larger than the limit)
/// @thread reentrant
[[nodiscard]] Result<DecodedImage> decode_png(std::string_view bytes, std::size_t limit_bytes, KeepColours keep);
[[nodiscard]] Result<DecodedImage> decode_tiff(std::string_view bytes, std::size_t limit_bytes, KeepColours keep);
[[nodiscard]] Result<DecodedImage> decode_pnm(std::string_view bytes, std::size_t limit_bytes, KeepColours keep);
[[nodiscard]] Result<DecodedImage> decode_jpeg(std::string_view bytes, std::size_t limit_bytes, KeepColours keep);

/// The image's size and samples that a header declares.
struct ImageLayout {
  std::uint64_t width_px = 0;
  std::uint64_t height_px = 0;
  int channels = 1;  ///< 1 grey; 2 grey, alpha; 3 red, green, blue; 4 red, green, blue, alpha
  int bytes_per_channel = 1;

  [[nodiscard]] std::size_t row_samples() const { return width_px * static_cast<std::size_t>(channels); }
  [[nodiscard]] bool colour() const { return channels > 2; }
  /// The size of all samples in bytes; a double, which cannot overflow.
  [[nodiscard]] double bytes() const {
    return static_cast<double>(width_px) * static_cast<double>(height_px) * channels * bytes_per_channel;
  }
};

/// @param file_bytes       size of the whole file
/// @param compression_max  greatest number of sample bytes in one byte of the file
/// @errors kMalformed if the file is too short for its header, kInvalidArgument beyond the limit
[[nodiscard]] Result<> check_layout(std::string_view format, const ImageLayout& layout, std::size_t file_bytes,
                                    double compression_max, std::size_t limit_bytes);

/// Converts a row of samples in the order of ImageLayout into grey, with the weights of ITU-R BT.601 and OpenCV's
/// rounding.
void grey_row(const std::uint8_t* samples, int channels, std::uint8_t* grey, int width_px);
void grey_row(const std::uint16_t* samples, int channels, std::uint16_t* grey, int width_px);

/// An image while its rows are read.
template <class T>
class DecodedRows {
 public:
  DecodedRows(const ImageLayout& layout, KeepColours keep)
      : channels_(layout.channels),
        colour_(layout.colour()),
        grey_(static_cast<int>(layout.width_px), static_cast<int>(layout.height_px)) {
    if (colour_ && keep == KeepColours::kYes) colours_ = ColourFrame(grey_.width(), grey_.height());
  }
  [[nodiscard]] int height() const { return grey_.height(); }
  /// @param samples  of a row, in the order of ImageLayout
  void set_row(int y, const T* samples) {
    grey_row(samples, channels_, grey_.row(y), grey_.width());
    if (colours_.empty()) return;
    for (int x = 0; x < grey_.width(); ++x, samples += channels_)
      colours_.at(x, y) = {samples[0], samples[1], samples[2]};
  }
  [[nodiscard]] DecodedImage take() { return {std::move(grey_), colour_, std::move(colours_)}; }

 private:
  int channels_;
  bool colour_;
  Image<T> grey_;
  ColourFrame colours_;
};

/// One message for all formats.
[[nodiscard]] tl::unexpected<Error> fail_truncated(std::string_view format);
[[nodiscard]] tl::unexpected<Error> fail_variant(std::string_view format, std::string_view what);

}  // namespace slsd
