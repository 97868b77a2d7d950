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

/// How long the first frame of a stream is waited for before a new stream is tried; most cameras need less.
/// @thread reentrant
[[nodiscard]] std::chrono::nanoseconds first_frame_patience(const AravisCameraOptions& options);

}  // namespace slsd
