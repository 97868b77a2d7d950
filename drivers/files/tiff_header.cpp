// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// TIFF 6.0: byte order, offset of the first directory; a directory is a count and entries of tag, type, count, value.
#include <algorithm>
#include <bit>
#include <initializer_list>
#include <optional>
#include <string>

#include "drivers/files/byte_reader.hpp"
#include "drivers/files/image_header.hpp"

namespace slsd {
namespace {

enum Tag : std::uint32_t {
  kWidth = 256,
  kHeight = 257,
  kBitsPerSample = 258,
  kCompression = 259,
  kPhotometric = 262,
  kStripOffsets = 273,
  kOrientation = 274,
  kSamplesPerPixel = 277,
  kRowsPerStrip = 278,
  kStripByteCounts = 279,
  kPlanarConfiguration = 284,
  kTileWidth = 322,
  kSampleFormat = 339,
};
constexpr std::uint32_t kUncompressed = 1;
constexpr std::uint32_t kGrey = 1;
constexpr std::uint32_t kRgb = 2;
constexpr std::uint32_t kShort = 3;
constexpr std::uint32_t kLong = 4;
constexpr std::uint64_t kEntryBytes = 12;

/// An entry's values, wherever they stand.
struct Values {
  ByteReader file;
  std::uint32_t type = 0;
  std::uint32_t count = 0;
  std::uint64_t offset = 0;

  [[nodiscard]] std::optional<std::uint32_t> at(std::uint32_t i) const {
    if (i >= count) return std::nullopt;
    return type == kShort ? file.u16(offset + 2 * std::uint64_t{i}) : file.u32(offset + 4 * std::uint64_t{i});
  }
};

/// The first directory of a file.
class Directory {
 public:
  explicit Directory(const ByteReader& file) : file_(file), at_(file.u32(4).value_or(0)) {}

  [[nodiscard]] std::optional<Values> find(Tag tag) const {
    const std::uint32_t entries = file_.u16(at_).value_or(0);
    for (std::uint32_t i = 0; i < entries; ++i) {
      const std::uint64_t entry = at_ + 2 + kEntryBytes * i;
      if (file_.u16(entry) == tag) return values(entry);
    }
    return std::nullopt;
  }

  /// The tag's first value, or what the format says of a tag that is absent.
  [[nodiscard]] std::uint32_t value(Tag tag, std::uint32_t otherwise) const {
    const auto found = find(tag);
    return found ? found->at(0).value_or(otherwise) : otherwise;
  }

 private:
  [[nodiscard]] std::optional<Values> values(std::uint64_t entry) const {
    const auto type = file_.u16(entry + 2), count = file_.u32(entry + 4), place = file_.u32(entry + 8);
    if (!place || (type != kShort && type != kLong)) return std::nullopt;
    const std::uint64_t bytes = std::uint64_t{*count} * (type == kShort ? 2 : 4);
    return Values{file_, *type, *count, bytes <= 4 ? entry + 8 : *place};
  }

  ByteReader file_;
  std::uint64_t at_;
};

bool one_of(std::uint32_t value, std::initializer_list<std::uint32_t> choices) {
  return std::find(choices.begin(), choices.end(), value) != choices.end();
}

/// What of the format OpenCV 4.6 does not decode faithfully, or in ways that are seldom trodden.
std::optional<std::string> find_rare(const Directory& directory, std::uint32_t samples, std::uint32_t bits) {
  if (directory.find(kTileWidth)) return "tiles";
  if (!one_of(directory.value(kCompression, kUncompressed), {kUncompressed, 5, 8, 32773, 32946}))
    return "this compression";
  const std::uint32_t photometric = directory.value(kPhotometric, 0);
  if (!one_of(photometric, {kGrey, kRgb})) return "inverted grey, a palette or unusual colours";
  if (samples != (photometric == kGrey ? 1 : 3) || !one_of(bits, {8, 16}))
    return "other than 1 or 3 channels of 8 or 16 bits";
  if (samples > 1 && directory.value(kPlanarConfiguration, 1) != 1) return "separate planes";
  if (directory.value(kOrientation, 1) != 1) return "turned or mirrored rows";
  if (directory.value(kSampleFormat, 1) != 1) return "signed or floating-point pixels";
  return std::nullopt;
}

/// True if every strip that the image needs lies within the file, and is as long as its rows where it is not
/// compressed.
bool has_strips(const Directory& directory, std::uint32_t height_px, std::uint64_t row_bytes,
                std::uint64_t file_bytes) {
  const bool compressed = directory.value(kCompression, kUncompressed) != kUncompressed;
  const std::uint32_t rows = std::clamp<std::uint32_t>(directory.value(kRowsPerStrip, height_px), 1, height_px);
  const std::uint32_t strips = (height_px - 1) / rows + 1;
  const auto offsets = directory.find(kStripOffsets);
  const auto lengths = directory.find(kStripByteCounts);
  if (!offsets || !lengths || lengths->count < strips || offsets->count < strips) return false;
  for (std::uint32_t i = 0; i < strips; ++i) {
    const auto offset = offsets->at(i), length = lengths->at(i);
    if (!offset || !length || *length == 0 || std::uint64_t{*offset} + *length > file_bytes) return false;
    if (!compressed && *length < std::min(rows, height_px - i * rows) * row_bytes) return false;
  }
  return true;
}

}  // namespace

Result<ImageHeader> read_tiff_header(std::string_view bytes) {
  const ByteReader file(bytes, bytes.starts_with("II") ? std::endian::little : std::endian::big);
  const Directory directory(file);
  const std::uint32_t width = directory.value(kWidth, 0), height = directory.value(kHeight, 0);
  if (width == 0 || height == 0) return fail_truncated("TIFF");
  const std::uint32_t samples = directory.value(kSamplesPerPixel, 1), bits = directory.value(kBitsPerSample, 1);
  if (const auto rare = find_rare(directory, samples, bits)) return fail_variant("TIFF", *rare);
  if (!has_strips(directory, height, std::uint64_t{width} * samples * bits / 8, file.size()))
    return fail_truncated("TIFF");
  return ImageHeader{width, height, static_cast<int>(samples), bits == 16 ? 2 : 1};
}

}  // namespace slsd
