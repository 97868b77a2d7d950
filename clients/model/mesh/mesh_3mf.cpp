// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/mesh/mesh_3mf.hpp"

#include <Model/COM/NMR_DLLInterfaces.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/cloud/point_record.hpp"

namespace slsd::model {
namespace {

/// Releases an object of lib3mf, whose handles are pointers to pointers.
struct Release {
  void operator()(void** object) const { NMR::lib3mf_release(object); }
};
using Held = std::unique_ptr<void*, Release>;

/// Tells whether every edge belongs to two triangles, one in each direction.
bool is_closed(const Mesh& mesh) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles)
    for (const auto& edge : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) edges.push_back(edge);
  std::ranges::sort(edges);
  return std::ranges::adjacent_find(edges) == edges.end() && std::ranges::all_of(edges, [&](const auto& edge) {
           return std::ranges::binary_search(edges, std::pair(edge.second, edge.first));
         });
}

/// Calls of lib3mf, one after the other; the first that fails ends them.
class Calls {
 public:
  template <class Function, class... Arguments>
  void operator()(Function* function, Arguments... arguments) {
    if (status_ == LIB3MF_OK) status_ = function(arguments...);
  }
  /// Calls a function that makes an object.
  template <class Function, class... Arguments>
  Held make(Function* function, Arguments... arguments) {
    void** object = nullptr;
    (*this)(function, arguments..., &object);
    return Held(object);
  }
  [[nodiscard]] LIB3MFRESULT status() const { return status_; }

 private:
  LIB3MFRESULT status_ = LIB3MF_OK;
};

}  // namespace

Result<std::string> write_3mf(const Mesh& mesh, std::string_view title) {
  if (mesh.triangles.empty()) return fail(ErrorCode::kNotFound, "there is no surface to write");
  std::vector<NMR::MODELMESHVERTEX> vertices(mesh.vertices_mm.size());
  for (std::size_t i = 0; i < vertices.size(); ++i)
    std::ranges::copy(mesh.vertices_mm[i], std::begin(vertices[i].m_fPosition));
  std::vector<NMR::MODELMESHTRIANGLE> triangles(mesh.triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i)
    std::ranges::copy(mesh.triangles[i], std::begin(triangles[i].m_nIndices));
  std::string name = header_text(title);
  std::erase_if(name, [](char c) { return c == '<' || c == '&' || c == '>'; });  // lib3mf 1.8 writes them as they are
  Calls call;
  const Held model = call.make(NMR::lib3mf_createmodel);
  call(NMR::lib3mf_model_setunit, model.get(), NMR::MODELUNIT_MILLIMETER);
  call(NMR::lib3mf_model_addmetadatautf8, model.get(), "Title", name.c_str());
  const Held object = call.make(NMR::lib3mf_model_addmeshobject, model.get());
  call(NMR::lib3mf_meshobject_setgeometry, object.get(), vertices.data(), static_cast<DWORD>(vertices.size()),
       triangles.data(), static_cast<DWORD>(triangles.size()));
  call(NMR::lib3mf_object_settype, object.get(),
       static_cast<DWORD>(is_closed(mesh) ? NMR::MODELOBJECTTYPE_MODEL : NMR::MODELOBJECTTYPE_SURFACE));
  const Held item = call.make(NMR::lib3mf_model_addbuilditem, model.get(), object.get(), nullptr);
  const Held writer = call.make(NMR::lib3mf_model_querywriter, model.get(), "3mf");
  ULONG64 size = 0;
  call(NMR::lib3mf_writer_getstreamsize, writer.get(), &size);
  std::string bytes(call.status() == LIB3MF_OK ? size : 0, '\0');
  call(NMR::lib3mf_writer_writetobuffer, writer.get(), reinterpret_cast<BYTE*>(bytes.data()), size);
  if (call.status() != LIB3MF_OK)
    return fail(ErrorCode::kIo, "the 3MF library failed (" + std::to_string(call.status()) + "): write .stl or .ply");
  return bytes;
}

}  // namespace slsd::model
