// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/camera_options.hpp"

namespace slsd {

std::string_view to_string(CameraDriver driver) {
  switch (driver) {
    case CameraDriver::kFile:
      return "file";
    case CameraDriver::kV4l2:
      return "v4l2";
    case CameraDriver::kAravis:
      return "aravis";
  }
  return {};
}

std::optional<double> CameraOptions::exposure_us() const {
  if (driver == CameraDriver::kV4l2) return v4l2.exposure_us;
  if (driver == CameraDriver::kAravis) return aravis.exposure_us;
  return std::nullopt;
}

std::string CameraOptions::format() const {
  if (driver == CameraDriver::kV4l2) return v4l2.format;
  return driver == CameraDriver::kAravis ? aravis.pixel_format : std::string();
}

Result<> CameraOptions::validate() const {
  if (name().empty() || name().size() > 64) return fail(ErrorCode::kInvalidArgument, "name must have 1 to 64 letters");
  if (driver == CameraDriver::kV4l2) return v4l2.validate();
  if (driver == CameraDriver::kAravis) return aravis.validate();
  if (driver != CameraDriver::kFile) return {};
  if (file.path.empty()) {
    return fail(ErrorCode::kInvalidArgument, "path must name an image or a folder of images for the driver \"file\"");
  }
  return file.validate();
}

}  // namespace slsd
