// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/frame_payload.hpp"

namespace slsd {
namespace {

constexpr std::size_t kChunkBytesMax = 1 << 16;  // of all that a camera may append by itself

}  // namespace

Result<std::size_t> read_payload_bytes(ArvCamera* camera, const DeviceLayout& layout, const ChunkSelection& chunks) {
  GErrorSlot error;
  const std::size_t payload = arv_camera_get_payload(camera, error.out());
  if (error.failed()) return fail(error.code(), "the camera tells no frame size: " + error.message(), "PayloadSize");
  const std::size_t most = layout.bytes() + (chunks.any() ? kChunkBytesMax : 0);
  if (payload >= layout.bytes() && payload <= most) return payload;
  return fail(ErrorCode::kMismatch,
              "the camera sends " + std::to_string(payload) + " bytes a frame, where its size and pixel format make " +
                  std::to_string(layout.bytes()) + "; turn off what it adds",
              "PayloadSize");
}

}  // namespace slsd
