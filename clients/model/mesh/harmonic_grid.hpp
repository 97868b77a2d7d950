// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace slsd::model {

/// A box of cells with values, some of them fixed.
/// @thread thread-bound
class HarmonicGrid {
 public:
  /// All cells are free and 0.
  explicit HarmonicGrid(const Eigen::Vector3i& size);

  [[nodiscard]] const Eigen::Vector3i& size() const { return size_; }
  [[nodiscard]] std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size_.y()) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(size_.x()) +
           static_cast<std::size_t>(x);
  }
  void fix(std::size_t cell, float value) { values_[cell] = value, fixed_[cell] = 1; }
  /// Fixes the outermost layer.
  void fix_border(float value);
  [[nodiscard]] bool fixed(std::size_t cell) const { return fixed_[cell] != 0; }
  [[nodiscard]] float value(std::size_t cell) const { return values_[cell]; }
  /// Value between the middles of cells, trilinear. @param at  in cells; the first has its middle at 0
  [[nodiscard]] float between(const Eigen::Vector3f& at) const;

  /// Gives free cells values so that each is the mean of its six neighbours (Laplace's equation), from coarse to fine.
  /// Its outermost layer must be fixed.
  void solve();

 private:
  [[nodiscard]] HarmonicGrid coarser() const;
  void start_from(const HarmonicGrid& coarse);
  void relax(int sweeps);

  Eigen::Vector3i size_;
  std::vector<float> values_;
  std::vector<std::uint8_t> fixed_;
};

}  // namespace slsd::model
