// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clients/model/background.hpp"
#include "clients/model/places/adjust.hpp"
#include "clients/model/places/seen_sides.hpp"
#include "clients/model/places/track.hpp"
#include "clients/model/range_image.hpp"
#include "core/mesh/mesh.hpp"
#include "core/result.hpp"

namespace slsd::model {

struct ModelOptions {
  std::optional<float> voxel_mm;  ///< nothing: by the clouds' pixels and sigmas
  std::optional<Box> box;         ///< in the rig's frame, mm; points outside are not of the object
  bool close = false;             ///< invent surface where none was measured, so that the mesh has no holes
  double step_degrees = 0;        ///< known turn from one cloud to the next, in either direction; 0: unknown
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
  double usual_sigma_mm = 0;  ///< of the mesh's measured vertices
  double invented_share = 0;  ///< of the mesh's area: no cloud measured it
  double turned_degrees = 0;  ///< all the way
};

struct Model {
  Mesh mesh;
  ModelReport report;
};

/// Tells of progress: a sentence for the user.
using Tell = std::function<void(const std::string&)>;

/// Tells how many of the clouds are fused; 0 of 0 while their places are adjusted.
using Advance = std::function<void(std::size_t done, std::size_t clouds)>;

/// Tracks an object through clouds, adjusts all places at once and fuses the clouds into a mesh in the frame of the rig
/// at the first cloud. Needs each cloud twice, so that memory holds the surface alone.
/// @thread thread-bound
class ModelBuilder {
 public:
  /// Gives a cloud that was added once more, as PLY.
  using Read = std::function<Result<std::string>(const std::string& name)>;
  /// Outcome of a cloud: it has a place unless `refusal` says why not.
  struct Added {
    std::string refusal;
    bool found_again = false;  ///< the cloud before had no place
  };

  ModelBuilder(Calibration calibration, const ModelOptions& options);

  /// Leaves out what a cloud of the scene without the object shows.
  /// @errors kMalformed: the PLY is no dense cloud; as of Background::of()
  [[nodiscard]] Result<> set_background(std::string_view ply);

  /// Places one more cloud. @errors kMismatch: the first cloud is of another calibration
  [[nodiscard]] Result<Added> add(const std::string& name, std::string_view ply);

  /// Notes a cloud that cannot be read.
  void leave_out(const std::string& name, std::string reason);

  /// The sides from which the object was seen so far.
  [[nodiscard]] SeenSides sides() const;
  /// Tells whether the object was seen from all sides, and the end meets the beginning. @param sides  as of sides()
  [[nodiscard]] bool closed(const SeenSides& sides) const;
  [[nodiscard]] std::size_t placed() const { return tracker_.frames().size(); }
  /// The clouds that were placed, in order.
  [[nodiscard]] const std::vector<ModelFrame>& frames() const { return tracker_.frames(); }

  /// Builds the mesh. Ends this object's work.
  /// @param advance  may be empty
  /// @errors kMalformed: no cloud can be used, or no two show the same place; of `read`
  [[nodiscard]] Result<Model> finish(const Read& read, const Tell& tell, const Advance& advance = {});

 private:
  [[nodiscard]] Result<std::vector<RangeImage>> read_images(std::string_view ply) const;

  Calibration calibration_;
  ModelOptions options_;
  std::optional<Background> background_;
  Tracker tracker_;
  ModelReport report_;
  std::vector<std::string> names_;
  float voxel_mm_ = 0;
};

}  // namespace slsd::model
