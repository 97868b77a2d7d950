// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>

#include "core/mesh/mesh.hpp"
#include "core/result.hpp"

namespace slsd::model {

/// Writes a mesh as 3MF, the file of printers and slicers (3MF Consortium, Core Specification 1.3): in mm, as one
/// object to build. The object is of type "model" if the mesh is closed, else "surface".
/// @errors kNotFound: there is no triangle; kIo: lib3mf failed
/// @thread reentrant
[[nodiscard]] Result<std::string> write_3mf(const Mesh& mesh, std::string_view title);

}  // namespace slsd::model
