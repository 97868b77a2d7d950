// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// Netpbm's PGM and PPM, plain and raw: P2, P3, P5, P6, then width, height, greatest value, one white space, pixels.
#include <optional>

#include "drivers/files/image_header.hpp"

namespace slsd {
namespace {

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

bool has_numbers(std::string_view text, double count) {
  Tokens tokens(text);
  for (; count > 0; --count)
    if (!tokens.number()) return false;
  return true;
}

}  // namespace

Result<ImageHeader> read_pnm_header(std::string_view bytes) {
  const char kind = bytes[1];
  if (kind != '2' && kind != '3' && kind != '5' && kind != '6') return fail_variant("PNM", "a kind but P2, P3, P5, P6");
  Tokens tokens(bytes.substr(2));
  const auto width = tokens.number(), height = tokens.number(), greatest = tokens.number();
  if (!width || !height || !greatest || *width == 0 || *height == 0 || *greatest == 0 || *greatest > 65535 ||
      tokens.rest().empty() || !is_space(tokens.rest().front()))
    return fail_truncated("PGM or PPM");
  const ImageHeader header{*width, *height, kind == '3' || kind == '6' ? 3 : 1, *greatest > 255 ? 2 : 1};
  const std::string_view pixels = tokens.rest().substr(1);
  const bool plain = kind < '5';
  const double numbers = header.decoded_bytes() / header.bytes_per_channel;
  const bool whole =
      plain ? has_numbers(pixels, numbers) : static_cast<double>(pixels.size()) >= header.decoded_bytes();
  if (!whole) return fail_truncated("PGM or PPM");
  return header;
}

}  // namespace slsd
