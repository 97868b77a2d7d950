// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>

#include "drivers/camera/aravis/aravis_camera_options.hpp"

namespace slsd {

[[nodiscard]] std::chrono::nanoseconds from_us(double duration_us);

/// How long after it was asked for a frame may come.
/// @thread reentrant
[[nodiscard]] std::chrono::nanoseconds frame_patience(const AravisCameraOptions& options);

/// So many streams are tried until one gives a frame.
inline constexpr int kFirstFrameTries = 3;

/// How long the first frame of a stream is waited for before a new stream is tried; most cameras need less.
/// @param trigger       kFreeRun or kSoftware, whichever proves that frames come
/// @param tries_before  0 to kFirstFrameTries - 1
/// @thread reentrant
[[nodiscard]] std::chrono::nanoseconds first_frame_patience(const AravisCameraOptions& options, AravisTrigger trigger,
                                                            int tries_before);

/// How long all of them together may take, with chunks and again without.
/// @thread reentrant
[[nodiscard]] std::chrono::nanoseconds first_frame_time_max(const AravisCameraOptions& options);

/// How long ago the exposure of a frame of a camera that runs freely may have begun for the one after it still to be of
/// now: a few periods.
/// @thread reentrant
[[nodiscard]] std::chrono::nanoseconds next_frame_age_max(const AravisCameraOptions& options);

}  // namespace slsd
