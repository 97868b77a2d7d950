// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "daemon/configuration/table_reader.hpp"
#include "drivers/camera/v4l2/v4l2_camera_options.hpp"

namespace slsd {

/// Reads the keys of a [[camera]] table whose driver is "v4l2", all but its name.
void read_v4l2_keys(TableReader& reader, V4l2CameraOptions& options);

}  // namespace slsd
