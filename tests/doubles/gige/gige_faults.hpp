// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <chrono>
#include <optional>

namespace slsd::test {

/// What a camera on a network does to those who use it. All of it is off at first.
struct GigeFaults {
  int drop_frames = 0;           ///< so many frames from now on are exposed and never sent
  int truncate_frames = 0;       ///< so many are sent by half, and end as if they were whole
  int stale_frames = 0;          ///< so many answer a trigger with what was exposed a second before
  int extra_frames = 0;          ///< so many triggers are answered with two frames
  int misexposed_frames = 0;     ///< so many say in their chunks that they were exposed twice as long as set
  int misgained_frames = 0;      ///< so many say in their chunks that their gain was 1 dB more than set
  int short_chunk_frames = 0;    ///< so many end within their chunks
  int garbage_chunk_frames = 0;  ///< so many have noise in the place of their chunks
  bool silent = false;           ///< answers, and sends no frame
  bool gone = false;             ///< neither answers nor sends
  int dies_after = -1;           ///< is gone after so many answers more; below 0: never
  bool resends = true;           ///< sends packets again when asked
  std::optional<std::chrono::steady_clock::time_point> stalled_until = {};  ///< exposes, and sends only then
};

/// What such a camera suffers now.
struct GigeTrouble {
  using Time = std::chrono::steady_clock::time_point;
  GigeFaults faults = {};
  std::optional<Time> off_until = {};  ///< without power

  /// Neither answers nor sends.
  [[nodiscard]] bool off() const { return faults.gone || off_until; }
  /// Exposes, and does not send yet.
  [[nodiscard]] bool stalled(Time now) const { return faults.stalled_until && now < *faults.stalled_until; }
  /// When part of it ends by itself; Time::max() where none does.
  [[nodiscard]] Time next_end(Time now) const {
    return std::min(off_until.value_or(Time::max()), stalled(now) ? *faults.stalled_until : Time::max());
  }
};

}  // namespace slsd::test
