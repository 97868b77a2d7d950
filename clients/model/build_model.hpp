// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "clients/model/adjust.hpp"
#include "clients/model/range_image.hpp"
#include "clients/model/recorded_clouds.hpp"
#include "core/mesh/mesh.hpp"
#include "core/result.hpp"

namespace slsd::model {

struct ModelOptions {
  std::optional<float> voxel_mm;  ///< nothing: by the clouds' pixels and sigmas
  std::optional<Box> box;         ///< in the rig's frame, mm; points outside are not of the object
};

/// A frame that is not in the model, and why.
struct RefusedFrame {
  std::string name, reason;
};

/// A frame of the model, and the object's place in it.
struct FusedFrame {
  std::string name;
  RigidTransform object_from_rig;
  double fit = 0;  ///< usual distance to the surfaces of linked frames over its sigma
};

/// Report about a model.
struct ModelReport {
  std::size_t frames = 0;
  std::vector<FusedFrame> fused;
  std::vector<RefusedFrame> refused;
  Adjustment adjustment;
  float voxel_mm = 0;
  std::size_t volume_bytes = 0;
  double usual_sigma_mm = 0;  ///< of the mesh's vertices
  double turned_degrees = 0;  ///< all the way
};

struct Model {
  Mesh mesh;
  ModelReport report;
};

/// Tells of progress: a sentence for the user.
using Tell = std::function<void(const std::string&)>;

/// Tracks the object through the clouds, adjusts all places at once and fuses the clouds into a mesh in the frame of
/// the rig at the first frame. Reads each cloud twice, so that memory holds the surface alone.
/// @errors kMalformed: no frame can be used, or no two show the same place; kMismatch: clouds of another calibration;
/// of reading files
[[nodiscard]] Result<Model> build_model(const RecordedClouds& recorded, const ModelOptions& options, const Tell& tell);

}  // namespace slsd::model
