// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "core/result.hpp"
#include "drivers/camera/camera.hpp"
#include "drivers/projector/projector.hpp"
#include "programs/latency/timepiece.hpp"

namespace slsd {

struct LatencyOptions {
  int flashes = 20;                         ///< 3 to 1000
  std::chrono::milliseconds settle{300};    ///< time after which black or white is certainly visible
  std::chrono::milliseconds timeout{2000};  ///< limit for a frame, and for a flash to be completely visible
  std::uint32_t seed = 1;  ///< seed of the pauses, whose variation makes flashes meet every phase of the camera
};

/// The delay until a camera sees the projector's image: from the return of Projector::show() to the start of a frame's
/// exposure.
struct CameraLatency {
  std::string camera;
  int flashes = 0;
  std::chrono::microseconds latency{};  ///< every frame that began this late or later was complete
  std::chrono::microseconds median{};   ///< of each flash's first complete frame, including the camera's own pace
  std::chrono::microseconds p05{};      ///< a twentieth of the flashes is earlier
  std::chrono::microseconds p95{};      ///< a twentieth is later
  bool clipped = false;                 ///< frames were overexposed: the times may be too short by up to one exposure

  friend bool operator==(const CameraLatency&, const CameraLatency&) = default;
};

/// Flashes the projector, black and white, and searches for the first frame with the complete white: at least 90 % of
/// it.
///
///     show(white) returns     light arrives
///     ----|-----------------------|------------------------>
///     [frame, dark]  [frame, in part]  [frame, whole]
///                     |<- the latest incomplete one    latency: the start of the earliest whole frame that began
///                                      |               after every incomplete frame of every flash
///
/// @param projector, camera  open
/// @errors kNotFound: no flash is visible; kTimeout: a flash was missed; if too many frames in a row are lost, the
///         error of the last; those of Projector::show() and Camera::capture()
/// @thread thread-bound, like projector and camera
[[nodiscard]] Result<CameraLatency> measure_latency(Projector& projector, Camera& camera, const LatencyOptions& options,
                                                    const Timepiece& time = {});

}  // namespace slsd
