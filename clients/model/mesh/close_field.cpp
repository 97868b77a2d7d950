// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/mesh/close_field.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <openvdb/tools/SignedFloodFill.h>

#include "clients/model/mesh/harmonic_grid.hpp"

namespace slsd::model {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;

constexpr int kLeafVoxels = 8;
constexpr double kMostCells = 4e6;
constexpr int kLeastWidth = 2;  // voxels of a cell

/// A box of cells around all known voxels, with room to the outside.
class Cells {
 public:
  explicit Cells(const FloatGrid& known) {
    const openvdb::CoordBBox box = known.evalActiveVoxelBoundingBox();
    const Coord extent = box.dim();
    const double room = 0.1 * std::max({extent.x(), extent.y(), extent.z()});
    const double voxels = (extent.x() + 2 * room) * (extent.y() + 2 * room) * (extent.z() + 2 * room);
    width_ = std::max(kLeastWidth, static_cast<int>(std::ceil(std::cbrt(voxels / kMostCells))));
    const int margin = static_cast<int>(room) + 3 * width_;
    low_ = box.min().offsetBy(-margin);
    for (int axis = 0; axis < 3; ++axis) size_[axis] = (extent[axis] + 2 * margin) / width_ + 2;
  }

  [[nodiscard]] const Eigen::Vector3i& size() const { return size_; }
  [[nodiscard]] std::size_t index_of(const HarmonicGrid& grid, const Coord& voxel) const {
    const Coord off = voxel - low_;
    return grid.index(off.x() / width_, off.y() / width_, off.z() / width_);
  }
  /// Place of a voxel among the middles of cells.
  [[nodiscard]] Eigen::Vector3f place_of(const Coord& voxel) const {
    const Coord off = voxel - low_;
    const Eigen::Vector3f middle = Eigen::Vector3f::Constant(0.5F * static_cast<float>(width_ - 1));
    return (Eigen::Vector3i(off.x(), off.y(), off.z()).cast<float>() - middle) / static_cast<float>(width_);
  }
  /// The voxels of a cell and of its neighbours.
  [[nodiscard]] openvdb::CoordBBox around(int x, int y, int z) const {
    const Coord first = low_.offsetBy((x - 1) * width_, (y - 1) * width_, (z - 1) * width_);
    return {first, first.offsetBy(3 * width_ - 1)};
  }

 private:
  int width_ = 1;
  Coord low_;
  Eigen::Vector3i size_;
};

void fix_known(const FloatGrid& known, const Cells& cells, HarmonicGrid& grid) {
  std::vector<float> sums(static_cast<std::size_t>(grid.size().prod()));
  std::vector<int> counts(sums.size());
  for (auto voxel = known.cbeginValueOn(); voxel; ++voxel) {
    const std::size_t cell = cells.index_of(grid, voxel.getCoord());
    sums[cell] += *voxel;
    ++counts[cell];
  }
  for (std::size_t cell = 0; cell < sums.size(); ++cell)
    if (counts[cell] > 0) grid.fix(cell, sums[cell] / static_cast<float>(counts[cell]));
  grid.fix_border(known.background());
}

/// Makes leaves where the cells change their sign.
void touch_crossings(const HarmonicGrid& grid, const Cells& cells, FloatGrid& field) {
  const Eigen::Vector3i& size = grid.size();
  for (int z = 1; z + 1 < size.z(); ++z)
    for (int y = 1; y + 1 < size.y(); ++y)
      for (int x = 1; x + 1 < size.x(); ++x) {
        const bool inside = grid.value(grid.index(x, y, z)) < 0;
        const auto changes = [&](int i, int j, int k) { return inside != (grid.value(grid.index(i, j, k)) < 0); };
        if (!changes(x + 1, y, z) && !changes(x, y + 1, z) && !changes(x, y, z + 1)) continue;
        const openvdb::CoordBBox box = cells.around(x, y, z);
        const Coord first = box.min() & ~(kLeafVoxels - 1);
        for (int i = first.x(); i <= box.max().x(); i += kLeafVoxels)
          for (int j = first.y(); j <= box.max().y(); j += kLeafVoxels)
            for (int k = first.z(); k <= box.max().z(); k += kLeafVoxels) field.tree().touchLeaf({i, j, k});
      }
}

}  // namespace

FloatGrid::Ptr close_field(const FloatGrid& known) {
  const float band = known.background();
  auto field = FloatGrid::create(band);
  if (known.activeVoxelCount() == 0) return field;
  const Cells cells(known);
  HarmonicGrid grid(cells.size());
  fix_known(known, cells, grid);
  grid.solve();
  for (auto leaf = known.tree().cbeginLeaf(); leaf; ++leaf) field->tree().touchLeaf(leaf->origin());
  touch_crossings(grid, cells, *field);
  const auto measured = known.getConstAccessor();
  for (auto leaf = field->tree().beginLeaf(); leaf; ++leaf) {
    for (openvdb::Index i = 0; i < openvdb::FloatTree::LeafNodeType::SIZE; ++i) {
      const Coord at = leaf->offsetToGlobalCoord(i);
      float value = 0;
      const bool is_known = measured.probeValue(at, value);
      leaf->setValueOn(i, std::clamp(is_known ? value : grid.between(cells.place_of(at)), -band, band));
    }
  }
  openvdb::tools::signedFloodFill(field->tree());
  return field;
}

}  // namespace slsd::model
