// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// For a build without device drivers (SLSD_DEVICES=OFF): no camera and no monitor is visible.
#include "drivers/camera/listing/list_cameras.hpp"
#include "drivers/projector/x11/choose_output.hpp"
#include "drivers/projector/x11/x_display.hpp"

namespace slsd {
namespace {

constexpr auto kAbsent = "this slsd was built without drivers for devices; ./run build builds one that has them";

}  // namespace

CameraListing list_cameras(const ListingPlaces& /*places*/) {
  return {{}, {kAbsent}};
}

Result<std::vector<RandrOutput>> list_outputs() {
  return fail(ErrorCode::kUnsupported, kAbsent);
}

Result<MonitorReport> report_monitor(const std::string& /*wanted*/, int /*width_px*/, int /*height_px*/,
                                     bool /*enable*/) {
  return fail(ErrorCode::kUnsupported, kAbsent);
}

std::string describe_output(const RandrOutput& output) {
  return output.name;
}

bool owns_display() {
  return false;
}

}  // namespace slsd
