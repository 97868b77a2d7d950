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

/// The nats by which a shape speaks for a cell: how much likelier it is as the letter of that cell than by chance.
///
/// Measured shares replace the doubt that a classification assumes: of shapes at each distance
/// from their prototype, those that show another letter than their cell's. A torn shape also speaks for an edge through
/// the symbol, the more, the fewer are torn amid the surfaces of the frame.
/// @thread thread-bound: keeps its buffers
class LetterEvidence {
 public:
  LetterEvidence(const CodeArray& array, CellGrid grid);

  /// Looks at a new frame, none of whose torn shapes speaks for an edge until measure_torn().
  void look_at(std::span<const Classification> shapes, std::span<const Aligned> aligned);
  /// @param labels   cells, one to a node
  void measure_torn(std::span<const Beside> beside, std::span<const std::int32_t> labels);

  /// Nats for a cell of the grid; below 0 against it.
  [[nodiscard]] float of(std::int32_t node, std::int32_t cell) const;
  [[nodiscard]] int letter_of(std::int32_t cell) const { return letters_[static_cast<std::size_t>(cell)]; }
  [[nodiscard]] const CellGrid& grid() const { return grid_; }
  [[nodiscard]] std::span<const Classification> shapes() const { return shapes_; }

 private:
  enum Wholeness : std::uint8_t { kWhole, kDoubtful, kTorn };
  static constexpr int kWholenesses = 3;
  [[nodiscard]] Wholeness wholeness_of(std::size_t node) const;

  CellGrid grid_;
  float letter_count_;
  std::vector<std::uint8_t> letters_;  // of each cell of the grid
  std::span<const Classification> shapes_;
  std::span<const Aligned> aligned_;
  std::array<float, kWholenesses> torn_nats_{};
  std::vector<std::uint8_t> agrees_;  // of each node: whether its shape speaks for its label
};

}  // namespace slsd
