// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/code/code_array.hpp"
#include "core/decode/grid/neighbourhood.hpp"
#include "core/decode/grid/sightings.hpp"
#include "core/decode/inference/cell_grid.hpp"
#include "core/decode/symbols/classify.hpp"

namespace slsd {

/// The nats by which a shape supports a cell: how much likelier the shape is as the letter of that cell than by chance.
///
/// The doubt that a classification assumes is replaced by measured shares: how many shapes at each distance from their
/// prototype show another letter than their cell's. A split shape is also evidence for an edge through the symbol. It
/// is stronger if fewer shapes inside the frame's surfaces are split.
/// @thread thread-bound: keeps its buffers
class LetterEvidence {
 public:
  LetterEvidence(const CodeArray& array, CellGrid grid);

  /// Starts a new frame. Until measure_split(), split shapes are no evidence for an edge.
  void look_at(std::span<const Classification> shapes, std::span<const Aligned> aligned);
  /// @param labels   cells, one for each node
  void measure_split(std::span<const Beside> beside, std::span<const std::int32_t> labels);

  /// Nats for a cell of the grid; negative if the shape contradicts it.
  [[nodiscard]] float of(std::int32_t node, std::int32_t cell) const;
  [[nodiscard]] int letter_of(std::int32_t cell) const { return letters_[static_cast<std::size_t>(cell)]; }
  [[nodiscard]] const CellGrid& grid() const { return grid_; }
  [[nodiscard]] std::span<const Classification> shapes() const { return shapes_; }

 private:
  enum Wholeness : std::uint8_t { kWhole, kDoubtful, kSplit };
  static constexpr int kWholenesses = 3;
  [[nodiscard]] Wholeness wholeness_of(std::size_t node) const;

  CellGrid grid_;
  float letter_count_;
  std::vector<std::uint8_t> letters_;  // for each cell of the grid
  std::span<const Classification> shapes_;
  std::span<const Aligned> aligned_;
  std::array<float, kWholenesses> split_nats_{};
  std::vector<std::uint8_t> agrees_;  // for each node: whether its shape supports its label
};

}  // namespace slsd
