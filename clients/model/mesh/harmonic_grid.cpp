// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/mesh/harmonic_grid.hpp"

#include <algorithm>
#include <array>

#include <tbb/parallel_for.h>

namespace slsd::model {
namespace {

constexpr int kSmallest = 8;  // cells on an axis, from which no coarser grid helps
constexpr int kSweeps = 40;
/// Successive over-relaxation (Young 1954) converges for 0 to 2.
constexpr float kRelaxation = 1.6F;

}  // namespace

HarmonicGrid::HarmonicGrid(const Eigen::Vector3i& size) : size_(size) {
  const std::size_t cells =
      static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y()) * static_cast<std::size_t>(size.z());
  values_.resize(cells);
  fixed_.resize(cells);
}

void HarmonicGrid::fix_border(float value) {
  for (int z = 0; z < size_.z(); ++z)
    for (int y = 0; y < size_.y(); ++y)
      for (int x = 0; x < size_.x(); ++x)
        if (x == 0 || y == 0 || z == 0 || x == size_.x() - 1 || y == size_.y() - 1 || z == size_.z() - 1)
          fix(index(x, y, z), value);
}

float HarmonicGrid::between(const Eigen::Vector3f& at) const {
  const Eigen::Vector3f inside =
      at.cwiseMax(0.0F).cwiseMin((size_ - Eigen::Vector3i::Ones()).cast<float>() - Eigen::Vector3f::Constant(0.001F));
  const Eigen::Vector3i low = inside.cast<int>();
  const Eigen::Vector3f part = inside - low.cast<float>();
  float sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i up(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
    const Eigen::Vector3f share =
        up.cast<float>().cwiseProduct(part) +
        (Eigen::Vector3f::Ones() - up.cast<float>()).cwiseProduct(Eigen::Vector3f::Ones() - part);
    const Eigen::Vector3i cell = low + up;
    sum += share.prod() * values_[index(cell.x(), cell.y(), cell.z())];
  }
  return sum;
}

/// Half as many cells on each axis: fixed to the mean of the fixed ones in them.
HarmonicGrid HarmonicGrid::coarser() const {
  HarmonicGrid coarse((size_ + Eigen::Vector3i::Ones()) / 2);
  std::vector<int> counts(coarse.values_.size());
  for (int z = 0; z < size_.z(); ++z)
    for (int y = 0; y < size_.y(); ++y)
      for (int x = 0; x < size_.x(); ++x) {
        const std::size_t from = index(x, y, z), to = coarse.index(x / 2, y / 2, z / 2);
        if (fixed_[from] == 0) continue;
        coarse.values_[to] += values_[from];
        ++counts[to];
      }
  for (std::size_t cell = 0; cell < counts.size(); ++cell)
    if (counts[cell] > 0) coarse.fix(cell, coarse.values_[cell] / static_cast<float>(counts[cell]));
  return coarse;
}

void HarmonicGrid::start_from(const HarmonicGrid& coarse) {
  tbb::parallel_for(0, size_.z(), [&](int z) {
    for (int y = 0; y < size_.y(); ++y)
      for (int x = 0; x < size_.x(); ++x) {
        const std::size_t cell = index(x, y, z);
        if (fixed_[cell] == 0)
          values_[cell] = coarse.between((Eigen::Vector3i(x, y, z).cast<float>().array() - 0.5F) / 2);
      }
  });
}

// Cells of one colour of a chessboard have neighbours of the other alone, so that threads do not meet.
void HarmonicGrid::relax(int sweeps) {
  const auto across = static_cast<std::ptrdiff_t>(size_.x());
  const std::ptrdiff_t down = across * static_cast<std::ptrdiff_t>(size_.y());
  for (int sweep = 0; sweep < 2 * sweeps; ++sweep) {
    tbb::parallel_for(1, size_.z() - 1, [&](int z) {
      for (int y = 1; y < size_.y() - 1; ++y)
        for (int x = 1 + (sweep + y + z) % 2; x < size_.x() - 1; x += 2) {
          const std::size_t cell = index(x, y, z);
          if (fixed_[cell] != 0) continue;
          float* const here = values_.data() + cell;
          const float mean =
              (here[-1] + here[1] + here[-across] + here[across] + here[-down] + here[down]) * (1.0F / 6);
          *here += kRelaxation * (mean - *here);
        }
    });
  }
}

void HarmonicGrid::solve() {
  if (size_.minCoeff() >= kSmallest) {
    HarmonicGrid coarse = coarser();
    coarse.solve();
    start_from(coarse);
  }
  relax(kSweeps);
}

}  // namespace slsd::model
