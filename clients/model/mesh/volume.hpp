// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "clients/model/places/shot.hpp"
#include "core/mesh/mesh.hpp"

namespace slsd::model {

struct VolumeOptions {
  float voxel_mm = 0.5F;
  /// Distances are kept up to so far on either side of the surface. A thinner wall has two sides that disturb each
  /// other.
  float band_mm = 2;
  /// Surface that fewer frames measured is left out.
  unsigned fewest_frames = 2;
};

/// A signed distance to the object's surface, in the voxels near it: the mean of all frames, weighted by 1/sigma^2
/// (Curless and Levoy 1996). Where light passed through, there is no surface. Where nothing was measured, neither:
/// holes stay holes.
/// @thread thread-bound
class Volume {
 public:
  explicit Volume(const VolumeOptions& options);
  Volume(Volume&&) noexcept;
  Volume& operator=(Volume&&) noexcept;
  ~Volume();

  /// @param shot  with its pixels
  void add(const Shot& shot, const RigidTransform& object_from_rig);

  /// The surface in the object's frame, with sigma, number of frames and intensity for each vertex; with its
  /// colour, too, if a shot had colours.
  [[nodiscard]] Mesh mesh() const;
  /// The same without holes: a surface is invented where none was measured. There `frames` is 0 and `sigma_mm` NaN.
  [[nodiscard]] Mesh closed_mesh() const;

  [[nodiscard]] std::size_t voxels() const;
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Grids;
  VolumeOptions options_;
  std::unique_ptr<Grids> grids_;
};

}  // namespace slsd::model
