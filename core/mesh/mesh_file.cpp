// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/mesh/mesh_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <iterator>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "core/cloud/point_record.hpp"

namespace slsd {
namespace {

static_assert(std::endian::native == std::endian::little, "the records are copied as they lie in memory");
static_assert(sizeof(Eigen::Vector3f) == 12 && sizeof(std::array<std::uint32_t, 3>) == 12);

using Triangle = std::array<std::uint32_t, 3>;

constexpr std::array<std::pair<std::string_view, MeshFormat>, 4> kNames{
    {{"ply", MeshFormat::kPly}, {"stl", MeshFormat::kStl}, {"obj", MeshFormat::kObj}, {"glb", MeshFormat::kGlb}}};

template <class Value>
void put(std::string& bytes, const Value& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Normal to a triangle, as long as twice its area.
Eigen::Vector3f cross_of(const Mesh& mesh, const Triangle& triangle) {
  const Eigen::Vector3f& a = mesh.vertices_mm[triangle[0]];
  return (mesh.vertices_mm[triangle[1]] - a).cross(mesh.vertices_mm[triangle[2]] - a);
}

std::string write_ply_mesh(const Mesh& mesh, std::string_view title) {
  std::string bytes = "ply\nformat binary_little_endian 1.0\ncomment " + header_text(title) +
                      "\ncomment units mm\nelement vertex " + std::to_string(mesh.vertices_mm.size()) +
                      "\nproperty float x\nproperty float y\nproperty float z\n";
  if (!mesh.sigma_mm.empty()) bytes += "property float sigma_mm\n";
  if (mesh.shows_colour()) bytes += kPlyColourLines;
  if (!mesh.frames.empty()) bytes += "property ushort frames\n";
  bytes += "element face " + std::to_string(mesh.triangles.size()) +
           "\nproperty list uchar int vertex_indices\nend_header\n";
  bytes.reserve(bytes.size() + mesh.vertices_mm.size() * 21 + mesh.triangles.size() * 13);
  for (std::size_t i = 0; i < mesh.vertices_mm.size(); ++i) {
    put(bytes, mesh.vertices_mm[i]);
    if (!mesh.sigma_mm.empty()) put(bytes, mesh.sigma_mm[i]);
    if (mesh.shows_colour()) append_colour(mesh.shown_colour(i), bytes);
    if (!mesh.frames.empty()) put(bytes, mesh.frames[i]);
  }
  for (const Triangle& triangle : mesh.triangles) {
    bytes += '\3';
    put(bytes, triangle);
  }
  return bytes;
}

std::string write_stl(const Mesh& mesh, std::string_view title) {
  // A header that begins with "solid" would be taken for the format in text.
  std::string bytes = "slsd, mm: " + header_text(title);
  bytes.resize(80, ' ');
  bytes.reserve(84 + 50 * mesh.triangles.size());
  put(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const Triangle& triangle : mesh.triangles) {
    put(bytes, Eigen::Vector3f(cross_of(mesh, triangle).normalized()));
    for (const std::uint32_t corner : triangle) put(bytes, mesh.vertices_mm[corner]);
    put(bytes, std::uint16_t{0});
  }
  return bytes;
}

std::string write_obj(const Mesh& mesh, std::string_view title) {
  std::string text = "# " + header_text(title) + "\n# units mm\n";
  const auto end = std::back_inserter(text);
  for (std::size_t i = 0; i < mesh.vertices_mm.size(); ++i) {
    const Eigen::Vector3f& vertex = mesh.vertices_mm[i];
    fmt::format_to(end, "v {:.4f} {:.4f} {:.4f}", vertex.x(), vertex.y(), vertex.z());
    // Not in the format's first description, but MeshLab, Blender, CloudCompare and Open3D read it.
    if (mesh.shows_colour())
      for (const std::uint8_t level : mesh.shown_colour(i)) fmt::format_to(end, " {:.4f}", level / 255.0);
    text += '\n';
  }
  for (const Triangle& triangle : mesh.triangles)
    fmt::format_to(end, "f {} {} {}\n", triangle[0] + 1, triangle[1] + 1, triangle[2] + 1);
  return text;
}

// glTF 2.0, sections 3 and 4. libtinygltf writes it too, but brings readers of PNG and JPEG into slsctl and keeps the
// mesh three times in memory.

/// Metres, y up, z towards the viewer.
Eigen::Vector3f gltf_place(const Eigen::Vector3f& place_mm) {
  return Eigen::Vector3f(place_mm.x(), -place_mm.y(), -place_mm.z()) / 1000;
}

struct GlbSizes {
  std::uint64_t places, colours, triangles;
  GlbSizes(std::uint64_t vertices, std::uint64_t triangle_count)
      : places(12 * vertices), colours(4 * vertices), triangles(12 * triangle_count) {}
  [[nodiscard]] std::uint64_t all() const { return 2 * places + colours + triangles; }
};

std::string gltf_description(const Mesh& mesh, std::string_view title, const GlbSizes& sizes) {
  Eigen::Vector3f low = gltf_place(mesh.vertices_mm.front()), high = low;
  for (const Eigen::Vector3f& vertex : mesh.vertices_mm) {
    const Eigen::Vector3f place = gltf_place(vertex);
    low = low.cwiseMin(place), high = high.cwiseMax(place);
  }
  std::string name = header_text(title);
  std::erase_if(name, [](char c) { return c == '"' || c == '\\' || static_cast<unsigned char>(c) > 0x7e; });
  const bool coloured = mesh.shows_colour();
  const auto accessor = [](int view, int type, std::uint64_t count, const char* shape, const std::string& more) {
    return fmt::format(R"({{"bufferView":{},"componentType":{},"count":{},"type":"{}"{}}})", view, type, count, shape,
                       more);
  };
  const auto view = [](std::uint64_t from, std::uint64_t length, int target) {
    return fmt::format(R"({{"buffer":0,"byteOffset":{},"byteLength":{},"target":{}}})", from, length, target);
  };
  constexpr int kByte = 5121, kIndex = 5125, kFloat = 5126, kOfVertices = 34962, kOfIndices = 34963;
  const std::size_t vertices = mesh.vertices_mm.size();
  const std::uint64_t coloured_end = 2 * sizes.places + (coloured ? sizes.colours : 0);
  std::string views = view(0, sizes.places, kOfVertices) + "," + view(sizes.places, sizes.places, kOfVertices) + "," +
                      view(coloured_end, sizes.triangles, kOfIndices);
  std::string accessors = accessor(0, kFloat, vertices, "VEC3",
                                   fmt::format(R"(,"min":[{},{},{}],"max":[{},{},{}])", low.x(), low.y(), low.z(),
                                               high.x(), high.y(), high.z())) +
                          "," + accessor(1, kFloat, vertices, "VEC3", "") + "," +
                          accessor(2, kIndex, 3 * mesh.triangles.size(), "SCALAR", "");
  if (coloured) {
    views += "," + view(2 * sizes.places, sizes.colours, kOfVertices);
    accessors += "," + accessor(3, kByte, vertices, "VEC4", R"(,"normalized":true)");
  }
  return fmt::format(
      R"({{"asset":{{"version":"2.0","generator":"slsd"}},"scene":0,"scenes":[{{"nodes":[0]}}],)"
      R"("nodes":[{{"mesh":0,"name":"{}"}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1{}}},)"
      R"("indices":2,"material":0}}]}}],"materials":[{{"pbrMetallicRoughness":{{"metallicFactor":0}},)"
      R"("doubleSided":true}}],"accessors":[{}],"bufferViews":[{}],"buffers":[{{"byteLength":{}}}]}})",
      name, coloured ? R"(,"COLOR_0":3)" : "", accessors, views, coloured_end + sizes.triangles);
}

std::string write_glb(const Mesh& mesh, std::string_view title) {
  const GlbSizes sizes(mesh.vertices_mm.size(), mesh.triangles.size());
  std::string description = gltf_description(mesh, title, sizes);
  description.resize((description.size() + 3) / 4 * 4, ' ');
  std::string bytes;
  bytes.reserve(28 + description.size() + sizes.all());
  bytes.append("glTF\2\0\0\0\0\0\0\0", 12);
  put(bytes, static_cast<std::uint32_t>(description.size()));
  bytes += "JSON" + description;
  const std::uint64_t data = sizes.all() - (mesh.shows_colour() ? 0 : sizes.colours);
  put(bytes, static_cast<std::uint32_t>(data));
  bytes.append("BIN\0", 4);
  for (const Eigen::Vector3f& vertex : mesh.vertices_mm) put(bytes, gltf_place(vertex));
  for (const Eigen::Vector3f& normal : normals_of(mesh)) {
    const Eigen::Vector3f unit = normal.squaredNorm() > 0 ? normal.normalized() : Eigen::Vector3f(0, 0, -1);
    put(bytes, Eigen::Vector3f(unit.x(), -unit.y(), -unit.z()));
  }
  for (std::size_t i = 0; mesh.shows_colour() && i < mesh.vertices_mm.size(); ++i) {
    append_colour(mesh.shown_colour(i), bytes);
    bytes += '\xff';
  }
  for (const Triangle& triangle : mesh.triangles) put(bytes, triangle);
  const auto length = static_cast<std::uint32_t>(bytes.size());
  std::memcpy(bytes.data() + 8, &length, sizeof length);
  return bytes;
}

}  // namespace

std::optional<MeshFormat> mesh_format(std::string_view name) {
  const auto* const found = std::ranges::find(kNames, name, [](const auto& each) { return each.first; });
  return found == kNames.end() ? std::nullopt : std::optional(found->second);
}

Result<> check_mesh_size(MeshFormat format, std::uint64_t vertices, std::uint64_t triangles) {
  constexpr std::uint64_t kHeader = 4096, kMost = std::numeric_limits<std::uint32_t>::max();
  if (format == MeshFormat::kGlb && GlbSizes(vertices, triangles).all() + kHeader > kMost)
    return fail(ErrorCode::kUnsupported, "the mesh is too large for GLB, which ends at 4 GiB: write .ply or .stl");
  if (format == MeshFormat::kStl && triangles > kMost)
    return fail(ErrorCode::kUnsupported, "the mesh has more triangles than STL can count: write .ply");
  if (vertices > kMost / 2)
    return fail(ErrorCode::kUnsupported, "the mesh has more than 2147483647 vertices: scan a part of the surface");
  return {};
}

Result<std::string> write_mesh(const Mesh& mesh, MeshFormat format, std::string_view title) {
  if (mesh.triangles.empty())
    return fail(ErrorCode::kNotFound, "there is no surface to write: no three adjacent pixels were measured");
  if (auto size = check_mesh_size(format, mesh.vertices_mm.size(), mesh.triangles.size()); !size)
    return tl::unexpected(size.error());
  switch (format) {
    case MeshFormat::kPly:
      return write_ply_mesh(mesh, title);
    case MeshFormat::kStl:
      return write_stl(mesh, title);
    case MeshFormat::kObj:
      return write_obj(mesh, title);
    case MeshFormat::kGlb:
      break;
  }
  return write_glb(mesh, title);
}

}  // namespace slsd
