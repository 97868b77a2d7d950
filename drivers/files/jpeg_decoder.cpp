// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/files/jpeg_decoder.hpp"

#include <jerror.h>

#include <algorithm>
#include <string>

#include "drivers/files/image_formats.hpp"
#include "drivers/files/jpeg_scan.hpp"

namespace slsd {
namespace {

tl::unexpected<Error> fail_damaged(const char* how) {
  return fail(ErrorCode::kMalformed, std::string("the JPEG image is damaged: ") + how);
}

/// Lists libjpeg's warnings that refuse a picture, each with its meaning. The other warnings concern headers, and
/// extraneous bytes, which count_blocks() judges.
const char* meaning_of(int warning) {
  switch (warning) {
    case JWRN_HIT_MARKER:
      return "part of its data is missing";
    case JWRN_HUFF_BAD_CODE:
    case JWRN_BOGUS_PROGRESSION:
      return "part of its data is corrupt";
    case JWRN_MUST_RESYNC:
      return "a restart marker is missing or out of order";
    case JWRN_JPEG_EOF:
      return "it ends early";
    default:
      return nullptr;
  }
}

// libjpeg decodes a band of a progressive image without a warning if its last bits are missing.
bool lacks_a_scan(const jpeg_decompress_struct& info) {
  if (info.coef_bits == nullptr) return false;
  for (int i = 0; i < info.num_components; ++i)
    if (std::any_of(info.coef_bits[i], info.coef_bits[i] + DCTSIZE2, [](int bits) { return bits != 0; })) return true;
  return false;
}

}  // namespace

void JpegDecoder::leave(j_common_ptr info) {
  std::longjmp(reinterpret_cast<Failure*>(info->err)->back, 1);
}

void JpegDecoder::note(j_common_ptr info, int level) {
  auto& failure = *reinterpret_cast<Failure*>(info->err);
  if (level >= 0) return;  // a trace
  const int code = failure.manager.msg_code;
  if (code == JWRN_EXTRANEOUS_DATA) failure.extraneous = true;
  if (failure.warning == 0 && meaning_of(code) != nullptr) failure.warning = code;
}

JpegDecoder::JpegDecoder(std::string_view bytes) : bytes_(bytes) {
  info_.err = ::jpeg_std_error(&failure_.manager);
  failure_.manager.error_exit = leave;
  failure_.manager.emit_message = note;
}

JpegDecoder::~JpegDecoder() {
  ::jpeg_destroy_decompress(&info_);
}

Result<> JpegDecoder::read_header() {
  if (!parse_header()) return fail_with_message();
  // If such data ends early, libjpeg continues with zeros, without a warning.
  if (info_.arith_code != FALSE) return fail_variant("JPEG", "arithmetic coding");
  if (info_.num_components == 4) return fail_variant("JPEG", "CMYK colours");
  if (info_.num_components != 1 && info_.num_components != 3)
    return fail_variant("JPEG", std::to_string(info_.num_components) + " components");
  return {};
}

Result<> JpegDecoder::read_grey(Grey8& grey) {
  if (!start(JCS_GRAYSCALE)) return fail_with_message();
  const bool counted = ::jpeg_has_multiple_scans(&info_) == FALSE;
  const bool lacking = lacks_a_scan(info_);  // start() has read all scans if there are several
  const ScanBlocks blocks = counted ? count_blocks(info_, scan_) : ScanBlocks::kAgree;
  if (!read_rows(grey)) return fail_damaged(meaning_of(JWRN_HUFF_BAD_CODE));  // for example, a header within the data
  if (blocks == ScanBlocks::kLeftOver || (failure_.extraneous && !counted))
    return fail_damaged("it has more data than blocks, so an earlier part is missing");
  if (failure_.warning != 0) return fail_damaged(meaning_of(failure_.warning));
  if (blocks == ScanBlocks::kMissing || lacking) return fail_damaged(meaning_of(JWRN_HIT_MARKER));
  return {};
}

Result<> JpegDecoder::read_colours(ColourFrame& colours) {
  row_.resize(3 * static_cast<std::size_t>(colours.width()));
  if (!start(JCS_RGB) || !read_rows(colours)) return fail_with_message();
  return {};
}

// The functions below hold no object with a destructor, because libjpeg may jump out of them.
bool JpegDecoder::parse_header() {
  if (setjmp(failure_.back) != 0) return false;
  ::jpeg_create_decompress(&info_);
  ::jpeg_mem_src(&info_, reinterpret_cast<const unsigned char*>(bytes_.data()), bytes_.size());
  ::jpeg_read_header(&info_, TRUE);
  scan_ = bytes_.substr(bytes_.size() - std::min(info_.src->bytes_in_buffer, bytes_.size()));
  failure_.extraneous = false;  // before a header they do no harm
  return true;
}

bool JpegDecoder::start(J_COLOR_SPACE colours) {
  if (setjmp(failure_.back) != 0) return false;
  info_.out_color_space = colours;
  info_.dct_method = JDCT_ISLOW;
  return ::jpeg_start_decompress(&info_) != FALSE;
}

bool JpegDecoder::read_rows(Grey8& grey) {
  if (setjmp(failure_.back) != 0) return false;
  while (info_.output_scanline < info_.output_height) {
    JSAMPROW row = grey.row(static_cast<int>(info_.output_scanline));
    ::jpeg_read_scanlines(&info_, &row, 1);
  }
  ::jpeg_finish_decompress(&info_);
  return true;
}

bool JpegDecoder::read_rows(ColourFrame& colours) {
  if (setjmp(failure_.back) != 0) return false;
  while (info_.output_scanline < info_.output_height) {
    ColourLevels* const pixels = colours.row(static_cast<int>(info_.output_scanline));
    JSAMPROW row = row_.data();
    ::jpeg_read_scanlines(&info_, &row, 1);
    for (int x = 0; x < colours.width(); ++x) pixels[x] = {row[3 * x], row[3 * x + 1], row[3 * x + 2]};
  }
  ::jpeg_finish_decompress(&info_);
  return true;
}

Result<> JpegDecoder::fail_with_message() const {
  switch (failure_.manager.msg_code) {
    case JERR_BAD_PRECISION:
      return fail_variant("JPEG", std::to_string(failure_.manager.msg_parm.i[0]) + " bits per sample");
    case JERR_SOF_UNSUPPORTED:
      return fail_variant("JPEG", "lossless or hierarchical coding");
    case JERR_CONVERSION_NOTIMPL:
    case JERR_BAD_J_COLORSPACE:
      return fail_variant("JPEG", "unusual colours");
    default:
      return fail_damaged(failure_.warning != 0 ? meaning_of(failure_.warning) : "one of its headers is invalid");
  }
}

}  // namespace slsd
