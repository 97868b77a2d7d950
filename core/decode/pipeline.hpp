// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/code/pattern.hpp"
#include "core/decode/cell_rays.hpp"
#include "core/decode/correspond.hpp"
#include "core/decode/decoder.hpp"
#include "core/decode/symbol_reader.hpp"
#include "core/geometry/ray_table.hpp"
#include "core/geometry/triangulator.hpp"

namespace slsd {

/// The way of one frame through the stages, from the symbols to the points. A copy is for another thread: what is large
/// and never changes is shared.
/// @thread thread-bound
class Decoder::Pipeline {
 public:
  /// @param paper  there where a stage is asked for the paper's way
  Pipeline(const Pattern& pattern, const Calibration& calibration, std::size_t camera_index,
           const DecodeOptions& options, std::optional<PaperWay> paper);

  const Decoding& decode(const GreyView& frame, double full, StageObserver* observer);
  [[nodiscard]] std::vector<SymbolMatch> read_anywhere(const GreyView& frame, double full) {
    return reader_.read_anywhere(frame, full, *cells_);
  }
  [[nodiscard]] std::uint8_t camera_index() const { return camera_index_; }
  [[nodiscard]] const Lens& camera_lens() const { return camera_.lens; }

 private:
  void decode_windows(const GreyView& frame);
  void correspond();
  void triangulate();

  void find_epipolar_segments();
  void add_point(std::size_t node, const Eigen::Vector2f& centre_px, const TriangulatedPoint& solved);

  CalibratedCamera camera_;
  std::uint8_t camera_index_;
  DecodeOptions options_;
  SymbolReader reader_;
  std::shared_ptr<const CellRays> cells_;  // shared with copies, as they never change
  RayTable camera_rays_;
  EpipolarGate epipolar_gate_;
  Triangulator triangulator_;
  Correspondence correspondence_;

  std::vector<PixelRay> rays_;
  std::vector<Eigen::Vector2f> ray_pixels_;
  std::vector<EpipolarSegment> segments_;
  Decoding decoding_;
};

}  // namespace slsd
