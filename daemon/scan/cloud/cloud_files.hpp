// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/cloud/byte_sink.hpp"
#include "core/cloud/cloud.hpp"
#include "core/decode/options.hpp"
#include "core/dense/cloud/dense_cloud.hpp"
#include "core/geometry/calibration.hpp"
#include "core/result.hpp"
#include "drivers/system/sealed_memory.hpp"

namespace slsd {

enum class CloudFormat : std::uint8_t { kPly, kPcd, kTiff };

[[nodiscard]] inline std::string_view to_string(CloudFormat format) {
  return format == CloudFormat::kPly ? "ply" : format == CloudFormat::kPcd ? "pcd" : "tiff";
}
[[nodiscard]] inline CloudFormat cloud_format(std::string_view name) {
  return name == "pcd" ? CloudFormat::kPcd : name == "tiff" ? CloudFormat::kTiff : CloudFormat::kPly;
}
[[nodiscard]] inline std::string_view to_string(Density density) {
  return density == Density::kPixels ? "pixels" : "symbols";
}

/// The form of a cloud that a client asks for. Only dense clouds have depth maps and normals. Depth maps are in their
/// camera's frame.
struct CloudForm {
  CloudFormat format = CloudFormat::kPly;
  Density density = Density::kSymbols;
  bool normals = false;
  bool in_base = false;  ///< in the robot's base instead of the rig's frame

  CloudForm() = default;
  constexpr CloudForm(CloudFormat of_format, Density of_density = Density::kSymbols,  // NOLINT: a format is a form
                      bool with_normals = false)
      : format(of_format), density(of_density), normals(with_normals) {}
  [[nodiscard]] bool dense() const { return density == Density::kPixels; }

  static constexpr unsigned kCount = 24;
  [[nodiscard]] unsigned index() const {
    return static_cast<unsigned>(format) + (dense() ? 3U : 0U) + (normals ? 6U : 0U) + (in_base ? 12U : 0U);
  }
  [[nodiscard]] static CloudForm of_index(unsigned index) {
    CloudForm form(static_cast<CloudFormat>(index % 3), index / 3 % 2 != 0 ? Density::kPixels : Density::kSymbols,
                   index / 6 % 2 != 0);
    form.in_base = index / 12 != 0;
    return form;
  }
};

/// The set of forms in which somebody wants a cloud.
class CloudFormats {
 public:
  [[nodiscard]] static CloudFormats only(CloudForm form) { return {1U << form.index(), 0}; }
  /// One memfd in that form.
  [[nodiscard]] static CloudFormats only_memory(CloudForm form) { return {0, 1U << form.index()}; }
  CloudFormats() = default;

  [[nodiscard]] bool has(CloudForm form) const { return (bytes_ >> form.index() & 1U) != 0; }
  [[nodiscard]] bool has_memory(CloudForm form) const { return (memory_ >> form.index() & 1U) != 0; }
  /// Tells whether a form needs a point for each pixel.
  [[nodiscard]] bool dense() const { return ((bytes_ | memory_) & 0b111000'111000'111000'111000U) != 0; }
  /// Two that want a memfd each share the bytes of the second.
  friend CloudFormats operator|(CloudFormats a, CloudFormats b) {
    return {a.bytes_ | b.bytes_ | (a.memory_ & b.memory_), a.memory_ | b.memory_};
  }
  friend bool operator==(CloudFormats, CloudFormats) = default;

 private:
  CloudFormats(std::uint32_t bytes, std::uint32_t memory) : bytes_(bytes), memory_(memory) {}
  std::uint32_t bytes_ = 0;   // by CloudForm::index()
  std::uint32_t memory_ = 0;  // by CloudForm::index()
};

/// Bytes that several clients may send, each at its own pace; hence shared.
using SharedBytes = std::shared_ptr<const std::string>;

/// A cloud's files, each written once. Copies share them.
/// @thread thread-bound; any thread may read the bytes
class CloudFiles {
 public:
  CloudFiles() = default;
  /// @param dense          null if no form needs it
  /// @param base_from_rig  of this cloud; if unknown, all forms stay in the rig's frame
  CloudFiles(const Cloud& cloud, const DenseCloud* dense, CloudFormats formats,
             const std::optional<RigidTransform>& base_from_rig = {});

  /// The transform of the points of a form; null: they are in the rig's frame.
  [[nodiscard]] const RigidTransform* base_from_rig(CloudForm form) const {
    return form.in_base && base_from_rig_ ? &*base_from_rig_ : nullptr;
  }

  /// Writes the file unless it exists already. @param cloud, dense  the same at each call
  [[nodiscard]] const SharedBytes& file(const Cloud& cloud, const DenseCloud* dense, CloudForm form);
  /// A memfd of its own for each call: the one that was written with the cloud, then copies.
  /// @param cloud, dense  the same at each call @errors kNoSpace; kIo
  [[nodiscard]] Result<SealedMemory> memory(const Cloud& cloud, const DenseCloud* dense, CloudForm form);

  [[nodiscard]] std::size_t bytes() const;

 private:
  void write(const Cloud& cloud, const DenseCloud* dense, CloudForm form, ByteSink& sink) const;

  std::optional<RigidTransform> base_from_rig_;
  std::array<SharedBytes, CloudForm::kCount> files_;
  std::array<std::shared_ptr<SealedMemory>, CloudForm::kCount> memories_;  // empty once they are given away
};

}  // namespace slsd
