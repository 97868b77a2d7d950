// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// Netpbm's PGM and PPM, plain and raw: P2, P3, P5, P6, then width, height, greatest value, one white space, pixels.
#include <algorithm>
#include <optional>
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

  /// The next number; white space and comments before it are passed over.
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

  [[nodiscard]] std::string_view rest() const { return rest_; }

 private:
  void skip_space() {
    while (!rest_.empty() && (is_space(rest_.front()) || rest_.front() == '#')) {
      if (rest_.front() == '#') rest_.remove_prefix(std::min(rest_.find('\n'), rest_.size()));
      if (!rest_.empty()) rest_.remove_prefix(1);
    }
  }

  std::string_view rest_;
};

struct Header {
  ImageLayout layout;
  std::uint64_t greatest = 0;
  bool plain = false;
  std::string_view pixels;
};

std::optional<Header> read_header(std::string_view bytes) {
  const char kind = bytes[1];
  Tokens tokens(bytes.substr(2));
  const auto width = tokens.number(), height = tokens.number(), greatest = tokens.number();
  const std::string_view rest = tokens.rest();
  if (!width || !height || !greatest || *greatest == 0 || *greatest > 65535 || rest.empty() || !is_space(rest.front()))
    return std::nullopt;
  const int channels = kind == '3' || kind == '6' ? 3 : 1;
  return Header{{*width, *height, channels, *greatest > 255 ? 2 : 1}, *greatest, kind < '5', rest.substr(1)};
}

template <class T>
bool read_plain_row(Tokens& tokens, std::uint64_t greatest, std::vector<T>& samples) {
  for (T& sample : samples) {
    const auto value = tokens.number();
    if (!value || *value > greatest) return false;
    sample = static_cast<T>(*value);
  }
  return true;
}

/// The most significant byte comes first.
template <class T>
void read_raw_row(std::string_view bytes, std::vector<T>& samples) {
  for (std::size_t i = 0; i < samples.size(); ++i) {
    unsigned value = 0;
    for (std::size_t j = 0; j < sizeof(T); ++j)
      value = value << 8 | static_cast<unsigned char>(bytes[i * sizeof(T) + j]);
    samples[i] = static_cast<T>(value);
  }
}

template <class T>
Result<DecodedImage> read_as(const Header& header) {
  const ImageLayout& layout = header.layout;
  std::vector<T> samples(layout.row_samples());
  Image<T> grey(static_cast<int>(layout.width_px), static_cast<int>(layout.height_px));
  Tokens tokens(header.pixels);
  for (int y = 0; y < grey.height(); ++y) {
    if (!header.plain)
      read_raw_row(header.pixels.substr(y * samples.size() * sizeof(T)), samples);
    else if (!read_plain_row(tokens, header.greatest, samples))
      return fail_truncated(kFormat);
    grey_row(samples.data(), layout.channels, grey.row(y), grey.width());
  }
  return DecodedImage{std::move(grey), layout.colour()};
}

}  // namespace

Result<DecodedImage> decode_pnm(std::string_view bytes, std::size_t limit_bytes) {
  if (std::string_view("2356").find(bytes[1]) == std::string_view::npos)
    return fail_variant("PNM", "a kind but P2, P3, P5 or P6");
  const auto header = read_header(bytes);
  if (!header) return fail_truncated(kFormat);
  // A plain number takes a digit and a space, and may stand for two bytes.
  auto checked = check_layout(kFormat, header->layout, header->pixels.size(), header->plain ? 2.0 : 1.0, limit_bytes);
  if (!checked) return tl::unexpected(std::move(checked.error()));
  if (header->layout.bytes_per_channel == 2) return read_as<std::uint16_t>(*header);
  return read_as<std::uint8_t>(*header);
}

}  // namespace slsd
