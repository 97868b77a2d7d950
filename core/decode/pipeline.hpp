// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <vector>

#include "core/code/pattern.hpp"
#include "core/decode/binarize.hpp"
#include "core/decode/cell_rays.hpp"
#include "core/decode/correspond.hpp"
#include "core/decode/curvature.hpp"
#include "core/decode/decode_windows.hpp"
#include "core/decode/decoder.hpp"
#include "core/decode/find_regions.hpp"
#include "core/decode/grey_moments.hpp"
#include "core/decode/lattice_frame.hpp"
#include "core/decode/link_grid.hpp"
#include "core/decode/paper/paper_way.hpp"
#include "core/decode/review_symbols.hpp"
#include "core/decode/sightings.hpp"
#include "core/decode/split_regions.hpp"
#include "core/geometry/ray_table.hpp"
#include "core/geometry/triangulator.hpp"

namespace slsd {

/// The way of one frame through the stages, with every buffer that they need.
/// @thread thread-bound
class Decoder::Pipeline {
 public:
  /// @param paper  there where a stage is asked for the paper's way
  Pipeline(const Pattern& pattern, const Calibration& calibration, std::size_t camera_index,
           const DecodeOptions& options, std::optional<PaperWay> paper);

  const Decoding& decode(const GreyView& frame, StageObserver* observer);
  [[nodiscard]] const Lens& camera_lens() const { return camera_.lens; }

 private:
  void binarize(const GreyView& frame);
  void find_regions(const GreyView& frame);
  void describe(const GreyView& frame);
  void classify();
  void link_grid();
  void decode_windows(const GreyView& frame);
  void correspond();
  void triangulate();
  void report();

  [[nodiscard]] RegionStatus judge_size(const Region& region) const;
  void classify_in_measured_frames();
  void find_epipolar_segments();
  [[nodiscard]] bool reviews() const;
  void add_point(std::size_t node, const TriangulatedPoint& solved);

  Pattern pattern_;
  CalibratedCamera camera_;
  std::uint8_t camera_index_;
  DecodeOptions options_;
  std::optional<PaperWay> paper_;
  ExpectedFrames expected_;
  std::vector<Prototype> prototypes_as_expected_, prototypes_as_measured_;
  Classifier classifier_as_expected_, classifier_as_measured_;
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
  SymbolReview review_;
  Correspondence correspondence_;
  CentreCorrection centre_correction_;

  Grey8 mask_;
  Regions regions_;
  std::vector<RegionStatus> region_status_;
  Sightings seen_;
  std::vector<PixelRay> rays_;
  std::vector<Eigen::Vector2f> ray_pixels_;
  std::vector<EpipolarSegment> segments_;
  std::vector<std::int8_t> letters_;
  std::vector<Eigen::Vector2f> centres_;
  float frame_levels_ = 1;  // of the frame, for one of 255
  Decoding decoding_;
};

}  // namespace slsd
