// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <openvdb/openvdb.h>

namespace slsd::model {

/// Continues a signed distance into voxels that are not known, so that its surface has no holes: by Laplace's equation,
/// whose solution is as smooth as the known voxels allow (after Davis, Marschner, Garr and Levoy 2002). Far from the
/// known voxels is outside.
/// @param known  active voxels are known; its background is the greatest distance, in the unit of the values
/// @return       active near the surface, with the right sign everywhere
/// @thread       reentrant
[[nodiscard]] openvdb::FloatGrid::Ptr close_field(const openvdb::FloatGrid& known);

}  // namespace slsd::model
