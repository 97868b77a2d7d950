// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/cloud/cloud_files.hpp"

#include <utility>

#include "core/cloud/pcd.hpp"
#include "core/cloud/ply.hpp"

namespace slsd {

CloudFiles::CloudFiles(const Cloud& cloud, const DenseCloud* dense, CloudFormats formats,
                       const std::optional<RigidTransform>& base_from_rig)
    : base_from_rig_(base_from_rig) {
  for (unsigned index = 0; index < CloudForm::kCount; ++index) {
    const CloudForm form = CloudForm::of_index(index);
    if (formats.has(form)) (void)file(cloud, dense, form);
    if (!formats.has_memory(form)) continue;
    auto memory = this->memory(cloud, dense, form);  // memory() tries again and reports the error
    if (memory) memories_[index] = std::make_shared<SealedMemory>(std::move(*memory));
  }
}

const SharedBytes& CloudFiles::file(const Cloud& cloud, const DenseCloud* dense, CloudForm form) {
  SharedBytes& bytes = files_[form.index()];
  if (bytes) return bytes;
  StringSink sink;
  write(cloud, dense, form, sink);
  bytes = std::make_shared<const std::string>(std::move(sink.bytes()));
  return bytes;
}

Result<SealedMemory> CloudFiles::memory(const Cloud& cloud, const DenseCloud* dense, CloudForm form) {
  if (auto& made = memories_[form.index()]; made && made->given) return std::exchange(*made, SealedMemory{});
  if (const SharedBytes& bytes = files_[form.index()]) return sealed_memory(*bytes);
  return sealed_memory([&](ByteSink& sink) { write(cloud, dense, form, sink); });
}

std::size_t CloudFiles::bytes() const {
  std::size_t sum = 0;
  for (const SharedBytes& file : files_) sum += file ? file->size() : 0;
  for (const auto& memory : memories_) sum += memory ? memory->bytes : 0;
  return sum;
}

void CloudFiles::write(const Cloud& cloud, const DenseCloud* dense, CloudForm form, ByteSink& sink) const {
  const bool ply = form.format == CloudFormat::kPly;
  const RigidTransform* const place = base_from_rig(form);
  if (!form.dense() || dense == nullptr) return sink.take(ply ? write_ply(cloud, place) : write_pcd(cloud, place));
  if (form.format == CloudFormat::kTiff) return sink.take(write_dense_tiff(*dense));
  return ply ? write_dense_ply(*dense, form.normals, place, sink) : write_dense_pcd(*dense, form.normals, place, sink);
}

}  // namespace slsd
