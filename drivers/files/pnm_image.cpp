// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// Netpbm's PGM and PPM, plain and raw: P2, P3, P5, P6, then width, height, greatest value, one white space, pixels.
#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/files/image_formats.hpp"

namespace slsd {
namespace {

constexpr std::string_view kFormat = "PGM or PPM";
constexpr std::uint64_t kNumberMax = 0x7fffffff;

bool is_space(char c) {
  return c == ' ' || (c >= '\t' && c <= '\r');
}
bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

class Tokens {
 public:
  explicit Tokens(std::string_view rest) : rest_(rest) {}

  /// The next number; white space and comments before it are skipped.
  std::optional<std::uint64_t> number() {
    skip_space();
    std::uint64_t value = 0;
    const std::size_t before = rest_.size();
    for (; !rest_.empty() && is_digit(rest_.front()); rest_.remove_prefix(1)) {
      value = 10 * value + static_cast<std::uint64_t>(rest_.front() - '0');
      if (value > kNumberMax) return std::nullopt;
    }
    if (rest_.size() == before) return std::nullopt;
    return value;
  }

  void skip_space() {
    while (!rest_.empty() && (is_space(rest_.front()) || rest_.front() == '#')) {
      skip_comment();
      if (!rest_.empty()) rest_.remove_prefix(1);
    }
  }

  /// Skips a comment up to its line's end, which counts as white space.
  void skip_comment() {
    if (rest_.starts_with('#')) rest_.remove_prefix(std::min(rest_.find_first_of("\r\n"), rest_.size()));
  }

  [[nodiscard]] std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
};

struct Header {
  ImageLayout layout;
  std::uint64_t greatest = 0;
  bool plain = false;
  bool crlf = false;        ///< the header ends in CR LF, whose CR is the one white space
  bool crlf_lines = false;  ///< the header contains earlier CR LF line ends
  std::string_view pixels;  ///< everything after the one white space

  [[nodiscard]] std::size_t pixel_bytes() const {
    return layout.row_samples() * layout.height_px * static_cast<std::size_t>(layout.bytes_per_channel);
  }
};

bool is_kind(std::string_view bytes) {
  return bytes.size() >= 2 && bytes[0] == 'P' && std::string_view("2356").find(bytes[1]) != std::string_view::npos;
}

std::optional<Header> read_header(std::string_view bytes) {
  const char kind = bytes[1];
  Tokens tokens(bytes.substr(2));
  const auto width = tokens.number(), height = tokens.number(), greatest = tokens.number();
  tokens.skip_comment();
  const std::string_view rest = tokens.rest();
  if (!width || !height || !greatest || *greatest == 0 || *greatest > 65535 || rest.empty() || !is_space(rest.front()))
    return std::nullopt;
  const int channels = kind == '3' || kind == '6' ? 3 : 1;
  const bool crlf_lines = bytes.substr(0, bytes.size() - rest.size()).find("\r\n") != std::string_view::npos;
  return Header{{*width, *height, channels, *greatest > 255 ? 2 : 1},
                *greatest,
                kind < '5',
                rest.starts_with("\r\n"),
                crlf_lines,
                rest.substr(1)};
}

// Tells whether whole images follow each other to the end, as netpbm's programs write them.
bool are_images(std::string_view bytes) {
  while (is_kind(bytes) && bytes[1] >= '5') {
    const auto next = read_header(bytes);
    if (!next || next->layout.bytes() > static_cast<double>(next->pixels.size())) return false;
    bytes = next->pixels.substr(next->pixel_bytes());
    if (bytes.empty()) return true;
  }
  return false;
}

tl::unexpected<Error> fail_left_over(const Header& header, std::size_t bytes) {
  return fail(
      ErrorCode::kMalformed,
      "the " + std::string(kFormat) + " header declares " + std::to_string(header.layout.width_px) + "x" +
          std::to_string(header.layout.height_px) + " pixels and greatest value " + std::to_string(header.greatest) +
          ", but " + std::to_string(bytes) +
          " bytes are left over; put exactly one white space and no comment between the greatest value and the pixels");
}

/// The bytes of a raw image's pixels. The specification ends the header in one white space. Writers in text mode write
/// CR LF instead. Only the length distinguishes that from a first pixel with the value of LF.
Result<std::string_view> raw_pixels(const Header& header) {
  const std::size_t needed = header.pixel_bytes();
  std::string_view pixels = header.pixels;
  const bool cut = pixels.size() == needed && header.crlf && header.crlf_lines;  // the last pixel is missing
  if (cut || pixels.size() < needed) return fail_truncated(kFormat);
  if (pixels.size() == needed + 1 && header.crlf) pixels.remove_prefix(1);
  const std::string_view rest = pixels.substr(needed);
  if (!rest.empty() && !are_images(rest)) return fail_left_over(header, rest.size());
  return pixels.substr(0, needed);
}

/// Reads the samples row by row from either kind of raster.
class Raster {
 public:
  static Result<Raster> of(const Header& header) {
    if (header.plain) return Raster(header, header.pixels);
    return raw_pixels(header).map([&](std::string_view pixels) { return Raster(header, pixels); });
  }

  template <class T>
  Result<> read_row(std::vector<T>& samples) {
    constexpr std::uint64_t kFull = std::numeric_limits<T>::max();
    for (T& sample : samples) {
      const auto value = header_.plain ? tokens_.number() : raw_number(sizeof(T));
      if (!value) return fail_truncated(kFormat);
      if (*value > header_.greatest)
        return fail(ErrorCode::kMalformed, "a pixel of the " + std::string(kFormat) + " image is " +
                                               std::to_string(*value) + ", but its header says at most " +
                                               std::to_string(header_.greatest) + "; write the file again");
      sample = static_cast<T>(header_.greatest == kFull ? *value
                                                        : (*value * kFull + header_.greatest / 2) / header_.greatest);
    }
    return {};
  }

  /// Checks plain images only: the end of raw images is already known.
  [[nodiscard]] Result<> finish() {
    tokens_.skip_space();
    if (header_.plain && !tokens_.rest().empty()) return fail_left_over(header_, tokens_.rest().size());
    return {};
  }

 private:
  Raster(const Header& header, std::string_view pixels) : header_(header), tokens_(pixels), raw_(pixels) {}

  // Most significant byte first.
  std::uint64_t raw_number(std::size_t bytes) {
    std::uint64_t value = 0;
    for (const char c : raw_.substr(0, bytes)) value = value << 8 | static_cast<unsigned char>(c);
    raw_.remove_prefix(bytes);
    return value;
  }

  Header header_;
  Tokens tokens_;
  std::string_view raw_;
};

template <class T>
Result<DecodedImage> read_as(const Header& header, KeepColours keep) {
  const ImageLayout& layout = header.layout;
  auto raster = Raster::of(header);
  if (!raster) return tl::unexpected(std::move(raster.error()));
  std::vector<T> samples(layout.row_samples());
  DecodedRows<T> image(layout, keep);
  for (int y = 0; y < image.height(); ++y) {
    if (auto read = raster->read_row(samples); !read) return tl::unexpected(std::move(read.error()));
    image.set_row(y, samples.data());
  }
  if (auto finished = raster->finish(); !finished) return tl::unexpected(std::move(finished.error()));
  return image.take();
}

}  // namespace

Result<DecodedImage> decode_pnm(std::string_view bytes, std::size_t limit_bytes, KeepColours keep) {
  if (!is_kind(bytes)) return fail_variant("PNM", "a type other than P2, P3, P5 or P6");
  const auto header = read_header(bytes);
  if (!header) return fail_truncated(kFormat);
  // A plain number has at least a digit and a space, and may become two bytes.
  auto checked = check_layout(kFormat, header->layout, header->pixels.size(), header->plain ? 2.0 : 1.0, limit_bytes);
  if (!checked) return tl::unexpected(std::move(checked.error()));
  if (header->layout.bytes_per_channel == 2) return read_as<std::uint16_t>(*header, keep);
  return read_as<std::uint8_t>(*header, keep);
}

}  // namespace slsd
