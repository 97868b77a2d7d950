// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <fstream>
#include <string>

#include "core/mesh/mesh_file.hpp"
#include "tests/core/mesh/any_mesh.hpp"

// write_meshes FOLDER: tetrahedron() as mesh.ply, .stl, .obj and .glb, for read_meshes.py.
int main(int argc, char** argv) {
  if (argc != 2) return 2;
  for (const char* const name : {"ply", "stl", "obj", "glb"}) {
    const auto bytes = slsd::write_mesh(slsd::tetrahedron(), *slsd::mesh_format(name), "a tetrahedron");
    if (!bytes) return 1;
    std::ofstream(std::string(argv[1]) + "/mesh." + name, std::ios::binary) << *bytes;
  }
}
