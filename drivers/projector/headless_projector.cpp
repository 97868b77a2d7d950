// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/headless_projector.hpp"

#include <algorithm>
#include <cmath>
#include <thread>

#include "core/image_size.hpp"

namespace slsd {
namespace {

constexpr int kSideMaxPx = 16384;

}  // namespace

Result<> HeadlessProjectorOptions::validate() const {
  if (width_px < 1 || width_px > kSideMaxPx)
    return fail(ErrorCode::kInvalidArgument, "must be between 1 and 16384", "width_px");
  if (height_px < 1 || height_px > kSideMaxPx)
    return fail(ErrorCode::kInvalidArgument, "must be between 1 and 16384", "height_px");
  if (auto valid = light.validate(); !valid) return valid;
  if (!(refresh_hz >= 1.0 && refresh_hz <= 1000.0))
    return fail(ErrorCode::kInvalidArgument, "must be between 1 and 1000", "refresh_hz");
  return {};
}

HeadlessProjector::HeadlessProjector(HeadlessProjectorOptions options)
    : options_(std::move(options)), description_{"headless", "headless", options_.width_px, options_.height_px} {}

Result<> HeadlessProjector::open(MonotonicTime) {
  if (auto valid = options_.validate(); !valid) return valid;
  light_ = LightCurve(options_.light).apply(Grey8(options_.width_px, options_.height_px));
  connected_ = true;
  complete_.reset();
  first_refresh_ = std::chrono::steady_clock::now();
  return {};
}

Result<MonotonicTime> HeadlessProjector::show(const Grey8& image, MonotonicTime deadline) {
  if (auto begun = begin(image); !begun) return tl::unexpected(begun.error());
  const MonotonicTime complete = *complete_;
  std::this_thread::sleep_until(std::min(complete, deadline));
  if (complete > deadline)
    return fail(ErrorCode::kTimeout, "the projector needs more time: allow a longer timeout", description_.monitor);
  complete_.reset();
  return complete;
}

Result<> HeadlessProjector::begin(const Grey8& image) {
  const bool under_way = complete_ && image == showing_;
  if (!under_way) ++shows_;
  if (!under_way && std::ranges::find(options_.disconnect_at, shows_) != options_.disconnect_at.end()) disconnect();
  if (auto connected = check({}); !connected) return connected;
  if (under_way) return {};
  if (image.width() != options_.width_px || image.height() != options_.height_px)
    return fail(ErrorCode::kMismatch,
                "the image is " + size_text(image.width(), image.height()) + " pixels, the projector " +
                    size_text(options_.width_px, options_.height_px) + "; make the pattern for this projector",
                description_.monitor);
  light_ = LightCurve(options_.light).apply(image);
  showing_ = image;
  complete_ = next_refresh(std::chrono::steady_clock::now()) + period();
  return {};
}

Result<Grey8> HeadlessProjector::read_back() {
  if (auto connected = check({}); !connected) return tl::unexpected(connected.error());
  return light_;
}

Result<> HeadlessProjector::check(MonotonicTime) {
  if (connected_) return {};
  return fail(ErrorCode::kDisconnected, "the projector is not connected; check its cable and open it again",
              description_.monitor);
}

std::chrono::nanoseconds HeadlessProjector::period() const {
  return std::chrono::nanoseconds(std::llround(1e9 / options_.refresh_hz));
}

MonotonicTime HeadlessProjector::next_refresh(MonotonicTime after) const {
  return first_refresh_ + ((after - first_refresh_) / period() + 1) * period();
}

}  // namespace slsd
