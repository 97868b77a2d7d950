// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/code/pattern.hpp"
#include "core/decode/binarize.hpp"
#include "core/decode/cell_rays.hpp"
#include "core/decode/classify.hpp"
#include "core/decode/correspond.hpp"
#include "core/decode/curvature.hpp"
#include "core/decode/decode_windows.hpp"
#include "core/decode/decoder.hpp"
#include "core/decode/find_regions.hpp"
#include "core/decode/grey_moments.hpp"
#include "core/decode/lattice_frame.hpp"
#include "core/decode/link_grid.hpp"
#include "core/decode/split_regions.hpp"
#include "core/geometry/ray_table.hpp"
#include "core/geometry/triangulator.hpp"

namespace slsd {

/// The way of one frame through the stages, with every buffer that they need.
/// @thread thread-bound
class Decoder::Pipeline {
 public:
  Pipeline(const Pattern& pattern, const Calibration& calibration, std::size_t camera_index,
           const DecodeOptions& options);

  const Decoding& decode(const GreyView& frame, StageObserver* observer);
  [[nodiscard]] const Lens& camera_lens() const { return camera_.lens; }

 private:
  void binarize(const GreyView& frame);
  void find_regions(const GreyView& frame);
  void split_merged(const GreyView& frame);
  void describe(const GreyView& frame);
  void classify_as_expected();
  void link_grid();
  void classify_as_measured();
  void decode_windows();
  void correspond();
  void trust_whole_symbols();
  [[nodiscard]] float distance_from_letter(std::size_t node, const GreyMoments& moments) const;
  void measure_again(const GreyView& frame);
  void correct_centres();
  void triangulate();
  void report();

  [[nodiscard]] RegionStatus judge_size(const Region& region) const;

  Pattern pattern_;
  CalibratedCamera camera_;
  std::uint8_t camera_index_;
  RigidTransform rig_from_camera_;
  DecodeOptions options_;
  ExpectedFrames expected_;
  std::vector<Prototype> prototypes_as_expected_, prototypes_as_measured_;
  CellRays cells_;
  RayTable camera_rays_;
  EpipolarGate epipolar_gate_;
  Triangulator triangulator_;

  Binarizer binarizer_;
  RegionFinder region_finder_;
  RegionSplitter splitter_;
  GreyMomentMeter meter_;
  GridLinker linker_;
  WindowDecoder window_decoder_;
  Correspondence correspondence_;
  CentreCorrection centre_correction_;

  Grey8 mask_;
  Regions regions_;
  std::vector<RegionStatus> region_status_;
  // One to a node of the grid: a region that may be a symbol.
  std::vector<std::int32_t> region_of_node_;
  std::vector<GreyMoments> moments_;
  std::vector<Classification> shapes_;
  std::vector<GridNode> nodes_;
  std::vector<PixelRay> rays_;
  std::vector<EpipolarSegment> segments_;
  std::vector<CellClaim> claims_;
  std::vector<std::uint8_t> trusted_;
  std::vector<std::int8_t> letters_;  // of the nodes' cells
  std::vector<Eigen::Vector2f> centres_;
  Decoding decoding_;
};

}  // namespace slsd
