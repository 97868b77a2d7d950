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
  int flashes = 20;                          ///< 3 to 1000
  std::chrono::milliseconds settle{300};     ///< time after which black, or white, is there for certain
  std::chrono::milliseconds patience{2000};  ///< limit for a frame, and for a flash to be seen whole
  std::uint32_t seed = 1;  ///< seed of the pauses, which vary so that flashes meet every phase of the camera
};

/// The delay until a camera sees what the projector shows. Times count from the moment that Projector::show() returned
/// to the start of a frame's exposure.
struct CameraLatency {
  std::string camera;
  int flashes = 0;
  std::chrono::microseconds latency{};  ///< every frame that began so late, or later, was whole
  std::chrono::microseconds median{};   ///< of each flash's first whole frame, with its wait for the camera's own pace
  std::chrono::microseconds p05{};      ///< the twentieth part of the flashes is earlier
  std::chrono::microseconds p95{};      ///< the twentieth part is later
  bool clipped = false;                 ///< frames were overexposed: the times may be too short, by an exposure at most

  friend bool operator==(const CameraLatency&, const CameraLatency&) = default;
};

/// Flashes the projector, black and white, and looks for the first frame that has the white whole, at least 90 % of it.
///
///     show(white) returns     light arrives
///     ----|-----------------------|------------------------>
///     [frame, dark]  [frame, in part]  [frame, whole]
///                     |<- latest that is not whole     latency: the soonest whole one that began after every frame
///                                      |               of every flash that was not
///
/// @param projector, camera  open
/// @errors kNotFound: no flash is seen; kTimeout: a flash is not seen; where too many frames in a row are lost, the
/// error
///         of the last; those of Projector::show() and Camera::capture()
/// @thread thread-bound, as projector and camera are
[[nodiscard]] Result<CameraLatency> measure_latency(Projector& projector, Camera& camera, const LatencyOptions& options,
                                                    const Timepiece& time = {});

}  // namespace slsd
