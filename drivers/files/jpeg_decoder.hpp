// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <csetjmp>
#include <cstdio>  // before jpeglib.h, which needs it
#include <string_view>
#include <vector>

#include <jpeglib.h>

#include "core/colour.hpp"
#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// Decodes one JPEG image from a file or a camera into grey, with libjpeg. A picture with missing data or displaced
/// blocks is an error. Accepts bytes after the end marker, bytes before a marker that form no blocks, and unusual
/// headers. If Huffman tables are missing, as in MJPG, the standard's tables apply.
///
/// The errors contain no remedy, because the caller knows it.
/// @thread thread-bound
class JpegDecoder {
 public:
  /// @param bytes  must outlive the decoder
  explicit JpegDecoder(std::string_view bytes);
  JpegDecoder(const JpegDecoder&) = delete;
  JpegDecoder& operator=(const JpegDecoder&) = delete;
  ~JpegDecoder();

  /// @errors kMalformed, kUnsupported (a rare variant, with its remedy)
  [[nodiscard]] Result<> read_header();
  /// The image's width, after its header was read.
  [[nodiscard]] int width_px() const { return static_cast<int>(info_.image_width); }
  [[nodiscard]] int height_px() const { return static_cast<int>(info_.image_height); }
  [[nodiscard]] bool colour() const { return info_.num_components > 1; }
  /// Reads luma, after the header.
  /// @param grey  in the image's size
  /// @errors kMalformed, kUnsupported
  [[nodiscard]] Result<> read_grey(Grey8& grey);
  /// Reads the colours of an image that has some, after the header. Data that read_grey() accepts is whole.
  /// @param colours  in the image's size
  /// @errors kMalformed, kUnsupported
  [[nodiscard]] Result<> read_colours(ColourFrame& colours);

 private:
  /// The target of libjpeg's long jumps for its own errors.
  struct Failure {
    jpeg_error_mgr manager;
    std::jmp_buf back;
    int warning;  ///< the first warning that refuses the picture; 0: none
    bool extraneous;
  };

  [[noreturn]] static void leave(j_common_ptr info);
  static void note(j_common_ptr info, int level);
  bool parse_header();
  bool start(J_COLOR_SPACE colours);
  bool read_rows(Grey8& grey);
  bool read_rows(ColourFrame& colours);
  [[nodiscard]] Result<> fail_with_message() const;

  std::string_view bytes_;
  std::string_view scan_;  ///< the bytes after the first scan's header
  Failure failure_{};
  jpeg_decompress_struct info_{};
  std::vector<JSAMPLE> row_;  // red, green and blue of each pixel
};

}  // namespace slsd
