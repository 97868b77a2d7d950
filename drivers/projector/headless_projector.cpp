// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/headless_projector.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <thread>
#include <utility>

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

Result<> HeadlessProjector::open() {
  if (auto valid = options_.validate(); !valid) return valid;
  if (!target_) {
    if (auto made = make_target(); !made) return made;
  }
  draw(Grey8(options_.width_px, options_.height_px));
  connected_ = true;
  first_refresh_ = std::chrono::steady_clock::now();
  return {};
}

Result<> HeadlessProjector::make_target() {
  auto target = OffscreenTarget::create(options_.width_px, options_.height_px);
  if (!target) return tl::unexpected(target.error());
  const auto current = (*target)->use();
  auto painter = TexelPainter::create(options_.width_px, options_.height_px, LightCurve(options_.light));
  if (!painter) return tl::unexpected(painter.error());
  target_ = std::move(*target);
  painter_ = *painter;
  return {};
}

void HeadlessProjector::draw(const Grey8& image) {
  const auto current = target_->use();
  painter_->load(image);
  painter_->draw();
}

Result<MonotonicTime> HeadlessProjector::show(const Grey8& image) {
  ++shows_;
  if (std::find(options_.disconnect_at.begin(), options_.disconnect_at.end(), shows_) != options_.disconnect_at.end())
    disconnect();
  if (auto connected = check(); !connected) return tl::unexpected(connected.error());
  if (image.width() != options_.width_px || image.height() != options_.height_px)
    return fail(ErrorCode::kMismatch,
                "the image is " + size_text(image.width(), image.height()) + " pixels, the projector " +
                    size_text(options_.width_px, options_.height_px) + "; make the pattern for this projector",
                description_.monitor);
  draw(image);
  const MonotonicTime complete = next_refresh(std::chrono::steady_clock::now()) + period();
  std::this_thread::sleep_until(complete);
  return complete;
}

Result<Grey8> HeadlessProjector::read_back() {
  if (auto connected = check(); !connected) return tl::unexpected(connected.error());
  const auto current = target_->use();
  return painter_->read();
}

Result<> HeadlessProjector::check() {
  if (connected_) return {};
  return fail(ErrorCode::kDisconnected, "the projector is not there; check its cable and open it again",
              description_.monitor);
}

std::chrono::nanoseconds HeadlessProjector::period() const {
  return std::chrono::nanoseconds(std::llround(1e9 / options_.refresh_hz));
}

MonotonicTime HeadlessProjector::next_refresh(MonotonicTime after) const {
  return first_refresh_ + ((after - first_refresh_) / period() + 1) * period();
}

}  // namespace slsd
