// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/ptp_lock.hpp"

#include <string_view>
#include <utility>

#include "drivers/camera/aravis/device_features.hpp"

namespace slsd {

// Where there is a latch, the status is of the moment when it was used last.
PtpLock read_ptp_lock(ArvCamera* camera) {
  const DeviceFeatures features(camera);
  for (const auto& [latch, name] :
       {std::pair("PtpDataSetLatch", "PtpStatus"), std::pair("GevIEEE1588DataSetLatch", "GevIEEE1588Status")}) {
    if (features.has(latch)) (void)features.execute(latch);
    if (!features.has(name)) continue;
    GErrorSlot error;
    const char* const text = arv_camera_get_string(camera, name, error.out());
    const std::string_view status = text == nullptr || error.failed() ? "" : text;
    return status == "Slave" || status == "Master" ? PtpLock::kLocked : PtpLock::kOpen;
  }
  return PtpLock::kUnknown;
}

}  // namespace slsd
