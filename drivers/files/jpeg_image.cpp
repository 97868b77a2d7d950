// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <csetjmp>
#include <cstdio>  // before jpeglib.h, which needs it
#include <utility>
#include <vector>

#include <jpeglib.h>

#include "drivers/files/image_formats.hpp"

namespace slsd {
namespace {

/// libjpeg-turbo's own errors leave by a long jump: nothing with a destructor lives in the functions below that it may
/// jump out of.
struct JpegFailure {
  jpeg_error_mgr manager;
  std::jmp_buf back;
};

[[noreturn]] void fail_decoding(j_common_ptr info) {
  std::longjmp(reinterpret_cast<JpegFailure*>(info->err)->back, 1);
}

void say_nothing(j_common_ptr) {}

class JpegReader {
 public:
  explicit JpegReader(std::string_view bytes) : bytes_(bytes) {
    info_.err = ::jpeg_std_error(&failure_.manager);
    failure_.manager.error_exit = fail_decoding;
    failure_.manager.output_message = say_nothing;
  }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;
  ~JpegReader() { ::jpeg_destroy_decompress(&info_); }

  bool read_header() {
    if (setjmp(failure_.back) != 0) return false;
    ::jpeg_create_decompress(&info_);
    ::jpeg_mem_src(&info_, reinterpret_cast<const unsigned char*>(bytes_.data()), bytes_.size());
    ::jpeg_read_header(&info_, TRUE);
    info_.out_color_space = info_.num_components == 1 ? JCS_GRAYSCALE : JCS_RGB;
    info_.dct_method = JDCT_ISLOW;
    return true;
  }

  [[nodiscard]] ImageLayout layout() const {
    return {info_.image_width, info_.image_height, info_.num_components == 1 ? 1 : 3, 1};
  }

  /// @return whether the whole of it was there; a file cut off goes on in grey, with a warning of libjpeg's
  bool read_rows(unsigned char* samples, std::size_t row_samples) {
    if (setjmp(failure_.back) != 0) return false;
    ::jpeg_start_decompress(&info_);
    while (info_.output_scanline < info_.output_height) {
      JSAMPROW row = samples + info_.output_scanline * row_samples;
      ::jpeg_read_scanlines(&info_, &row, 1);
    }
    ::jpeg_finish_decompress(&info_);
    return failure_.manager.num_warnings == 0;
  }

 private:
  std::string_view bytes_;
  JpegFailure failure_{};
  jpeg_decompress_struct info_{};
};

}  // namespace

Result<DecodedImage> decode_jpeg(std::string_view bytes, std::size_t limit_bytes) {
  constexpr double kRatioMax = 1200;  // a block of 64 samples takes a bit at the least
  JpegReader reader(bytes);
  if (!reader.read_header()) return fail_truncated("JPEG");
  const ImageLayout layout = reader.layout();
  auto checked = check_layout("JPEG", layout, bytes.size(), kRatioMax, limit_bytes);
  if (!checked) return tl::unexpected(std::move(checked.error()));
  std::vector<unsigned char> samples(layout.row_samples() * layout.height_px);
  if (!reader.read_rows(samples.data(), layout.row_samples())) return fail_truncated("JPEG");
  Grey8 grey(static_cast<int>(layout.width_px), static_cast<int>(layout.height_px));
  for (int y = 0; y < grey.height(); ++y) {
    grey_row(samples.data() + static_cast<std::size_t>(y) * layout.row_samples(), layout.channels, grey.row(y),
             grey.width());
  }
  return DecodedImage{std::move(grey), layout.colour()};
}

}  // namespace slsd
