// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <variant>

#include "drivers/files/read_image.hpp"

namespace {

/// Whatever comes back has pixels and keeps to the limit.
void check(const slsd::GreyImage& image, std::size_t limit_bytes) {
  const auto bytes = std::visit([](const auto& pixels) { return pixels.size() * sizeof(*pixels.data()); }, image);
  if (bytes == 0 || bytes > limit_bytes) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  constexpr std::size_t kLimit = 1u << 22;
  const slsd::ReadImageOptions options{.bayer = slsd::BayerPattern::kRggb, .limit_decoded_bytes = kLimit};
  const auto image = slsd::decode_image({reinterpret_cast<const char*>(bytes), size}, "fuzz", options);
  if (image) check(*image, kLimit);
  if (!image && image.error().message.empty()) std::abort();
  return 0;
}
