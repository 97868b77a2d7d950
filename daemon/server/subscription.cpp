// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/subscription.hpp"

#include <utility>

#include "daemon/rpc/message.hpp"
#include "daemon/server/scan_json.hpp"

namespace slsd {

SharedBytes Publication::cloud(CloudFormat format) {
  SharedBytes& bytes = format == CloudFormat::kPly ? ply_ : pcd_;
  if (!bytes) bytes = std::make_shared<const std::string>(write_cloud((*scan_)->cloud, format));
  return bytes;
}

void Subscription::offer(SharedPublication publication, Clock::time_point now) {
  if (rate_hz_) {
    const auto period = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1.0 / *rate_hz_));
    // Scans made at this very rate come a little early as often as late.
    if (now + period / 10 < next_) return;
    next_ = next_ + period > now ? next_ + period : now + period;
  }
  if (waiting_ && waiting_->scan()) ++lost_;
  waiting_ = std::move(publication);
}

std::optional<Outgoing> Subscription::take() {
  const SharedPublication publication = std::exchange(waiting_, nullptr);
  if (!publication) return std::nullopt;
  Outgoing event;
  event.kind = Outgoing::Kind::kEvent;
  if (!publication->scan()) {
    event.line = to_line(event_message("scan_failed", {{"error", rpc_error(publication->scan().error()).to_json()}}));
    return event;
  }
  event.bytes = publication->cloud(format_);
  nlohmann::json params = scan_json(*publication->scan());
  params["format"] = to_string(format_);
  params["bytes"] = event.bytes->size();
  params["lost"] = std::exchange(lost_, 0);
  event.line = to_line(event_message("cloud", std::move(params)));
  return event;
}

}  // namespace slsd
