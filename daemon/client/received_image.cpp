// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/client/received_image.hpp"

namespace slsd {
namespace {

template <class T>
Result<GreyView> view_of(const std::string& bytes, int width_px, int height_px) {
  const std::size_t pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  if (width_px <= 0 || height_px <= 0 || bytes.size() != pixels * sizeof(T)) {
    return fail(ErrorCode::kMalformed, "the daemon's frame has not as many bytes as its size asks for");
  }
  return ImageView<T>{reinterpret_cast<const T*>(bytes.data()), width_px, height_px, width_px};
}

}  // namespace

Result<GreyView> image_of(const nlohmann::json& about, const Received& received) {
  const int width_px = about.value("width_px", 0);
  const int height_px = about.value("height_px", 0);
  if (about.value("bits", 8) == 16) return view_of<std::uint16_t>(received.bytes, width_px, height_px);
  return view_of<std::uint8_t>(received.bytes, width_px, height_px);
}

}  // namespace slsd
