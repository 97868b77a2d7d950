// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/mesh/mesh.hpp"
#include "core/result.hpp"

namespace slsd {

/// docs/formats.md describes each.
enum class MeshFormat { kPly, kStl, kObj, kGlb };

/// "stl": the format of that name.
[[nodiscard]] std::optional<MeshFormat> mesh_format(std::string_view name);

/// Checks that the format can hold that many.
/// @errors kUnsupported: it cannot; the message names formats that can
[[nodiscard]] Result<> check_mesh_size(MeshFormat format, std::uint64_t vertices, std::uint64_t triangles);

/// Writes a mesh in the frame of its vertices, in mm; GLB in metres with y up and z towards the viewer.
/// @param title  what the file says of itself, as far as its format has a place for that
/// @errors kNotFound: there is no triangle; kUnsupported: as of check_mesh_size()
/// @thread reentrant
[[nodiscard]] Result<std::string> write_mesh(const Mesh& mesh, MeshFormat format, std::string_view title);

}  // namespace slsd
