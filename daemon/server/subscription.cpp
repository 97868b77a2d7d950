// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/subscription.hpp"

#include <utility>

#include "daemon/server/methods/scan_json.hpp"
#include "rpc/message.hpp"

namespace slsd {

void Subscription::offer(SharedPublication publication, Clock::time_point now) {
  if (!publication->fits(form_)) return;
  if (rate_hz_) {
    const auto period = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1.0 / *rate_hz_));
    // Scans at exactly this rate arrive a little early as often as late.
    if (now + period / 10 < next_) return;
    next_ = next_ + period > now ? next_ + period : now + period;
  }
  waiting_.push_back({std::move(publication), now});
  drop_old(now);
}

void Subscription::drop_old(Clock::time_point now) {
  while (waiting_.size() > 1 && (waiting_.size() > kWaitingMax || now - waiting_.front().since > kTurn)) {
    lose_oldest();
  }
}

void Subscription::lose_oldest() {
  if (waiting_.front().publication->scan()) ++lost_, ++uncounted_;
  waiting_.pop_front();
}

std::size_t Subscription::waiting_bytes() const {
  std::size_t bytes = 0;
  for (const Waiting& each : waiting_) bytes += each.publication->bytes();
  return bytes;
}

std::optional<Outgoing> Subscription::take(Clock::time_point now) {
  drop_old(now);
  if (waiting_.empty()) return std::nullopt;
  const SharedPublication publication = std::move(waiting_.front().publication);
  waiting_.pop_front();
  Outgoing event;
  event.kind = Outgoing::Kind::kEvent;
  if (!publication->scan()) {
    event.line = to_line(event_message("scan_failed", {{"error", rpc_error(publication->scan().error()).to_json()}}));
    return event;
  }
  nlohmann::json params = scan_json(*publication->scan(), form_.density);
  params["format"] = to_string(form_.format);
  add_frame(params, publication->base_from_rig(form_));
  if (as_memfd_) {
    auto memory = publication->memory(form_);
    if (!memory) {
      ++lost_;  // the next event reports it
      event.line = to_line(event_message("scan_failed", {{"error", rpc_error(memory.error()).to_json()}}));
      return event;
    }
    params["memfd_bytes"] = event.lent_bytes = memory->bytes;
    event.descriptor = std::move(memory->given), event.kept = std::move(memory->kept);
  } else {
    event.bytes = publication->cloud(form_);
    params["bytes"] = event.bytes->size();
  }
  params["latency_ms"] = latency_ms(publication->scan()->received);
  params["lost"] = std::exchange(lost_, 0);
  event.line = to_line(event_message("cloud", std::move(params)));
  return event;
}

}  // namespace slsd
