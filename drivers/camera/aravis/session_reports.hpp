// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>

#include "drivers/camera/aravis/capture_events.hpp"
#include "drivers/camera/aravis/g_object.hpp"

namespace slsd {

/// Makes the camera's stream, which reports each buffer that is done, and stamps it with the time.
/// @param events  outlive the stream
[[nodiscard]] GObjectPtr<ArvStream> make_reporting_stream(ArvCamera* camera, CaptureEvents& events,
                                                          std::uint64_t session, GErrorSlot& error);

/// Has the device report when it does not answer any more, or another application took control.
/// @return the handler, to be disconnected before the events end
[[nodiscard]] unsigned long report_loss(ArvDevice* device, CaptureEvents& events, std::uint64_t session);

}  // namespace slsd
