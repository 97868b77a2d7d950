// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "daemon/configuration/table_reader.hpp"
#include "drivers/camera/aravis/aravis_camera_options.hpp"

namespace slsd {

/// Reads the keys of a [[camera]] table whose driver is "aravis", all but its name.
void read_aravis_keys(TableReader& reader, AravisCameraOptions& options);

}  // namespace slsd
