// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/curvature.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <Eigen/LU>

#include "core/code/symbol.hpp"
#include "tests/core/decode/alone.hpp"
#include "tests/core/decode/decoded_scene.hpp"
#include "tests/core/decode/grid/simulated_grid.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

constexpr int kSizePx = 16;
constexpr int kSide = 7;  // of the block of cells

/// Places of a symbol's lit pixels from the middle of its square.
std::vector<Eigen::Vector2d> lit_places(int number) {
  const Grey8 drawn = draw_symbol(number, kSizePx);
  std::vector<Eigen::Vector2d> places;
  for (int y = 0; y < kSizePx; ++y) {
    for (int x = 0; x < kSizePx; ++x) {
      if (drawn.at(x, y) != 0) places.emplace_back(x - 7.5, y - 7.5);
    }
  }
  return places;
}

Prototype exact_prototype(const std::vector<Eigen::Vector2d>& places) {
  Eigen::Vector2d mean(0, 0);
  Eigen::Matrix2d moments = Eigen::Matrix2d::Identity() / 12;
  for (const Eigen::Vector2d& p : places) mean += p / static_cast<double>(places.size());
  for (const Eigen::Vector2d& p : places)
    moments += (p - mean) * (p - mean).transpose() / static_cast<double>(places.size());
  moments /= kSizePx * kSizePx;
  Prototype prototype;
  prototype.mean.setZero();
  prototype.mean.head<4>() << 1, static_cast<float>(moments(0, 0)), static_cast<float>(moments(0, 1)),
      static_cast<float>(moments(1, 1));
  prototype.centroid_px = mean.cast<float>();
  return prototype;
}

struct Errors {
  double before = 0, after = 0;  ///< RMS of the centre, camera px
};

/// A block of one symbol on a surface, each seen without noise: the centroid of its image is its lit pixels' mean,
/// weighted with the area that they have in the camera.
class Block {
 public:
  Block(int symbol, const Surface& surface) : rig_(paper_rig()), surface_(surface), places_(lit_places(symbol)) {}

  Errors errors_around(const Eigen::Vector2d& middle_px) {
    const Prototype prototype = exact_prototype(places_);
    for (int row = 0; row < kSide; ++row) {
      for (int column = 0; column < kSide; ++column) {
        const Eigen::Vector2d square = middle_px + 18. * Eigen::Vector2d(column - kSide / 2, row - kSide / 2);
        add(row, column, square, square + prototype.centroid_px.cast<double>());
      }
    }
    grid_.link_truly();
    const CodeArray one_letter{kSide, kSide, 1, std::vector<std::uint8_t>(kSide * kSide, 0)};
    Lattice lattice;
    CentreCorrection({prototype}, 18, kSizePx).correct(grid_.nodes, moments_, claims_, one_letter, alone, lattice);
    Errors sum;
    for (std::size_t i = 0; i < moments_.size(); ++i) {
      sum.before += (Eigen::Vector2d(moments_[i].x, moments_[i].y) - truth_[i]).squaredNorm();
      sum.after += (lattice.symbols.at(i).centre_px.cast<double>() - truth_[i]).squaredNorm();
    }
    const auto count = static_cast<double>(moments_.size());
    return {std::sqrt(sum.before / count), std::sqrt(sum.after / count)};
  }

 private:
  [[nodiscard]] Eigen::Vector2d seen(const Eigen::Vector2d& projector_px) const {
    return camera_from_projector(projector_px, rig_, surface_).value();
  }
  [[nodiscard]] Eigen::Matrix2d derivative(const Eigen::Vector2d& at) const {
    Eigen::Matrix2d result;
    result.col(0) = seen(at + Eigen::Vector2d(0.5, 0)) - seen(at - Eigen::Vector2d(0.5, 0));
    result.col(1) = seen(at + Eigen::Vector2d(0, 0.5)) - seen(at - Eigen::Vector2d(0, 0.5));
    return result;
  }
  void add(int row, int column, const Eigen::Vector2d& square, const Eigen::Vector2d& centroid) {
    Eigen::Vector2d sum(0, 0);
    double weight = 0;
    for (const Eigen::Vector2d& place : places_) {
      const double area = std::abs(derivative(square + place).determinant());
      sum += area * seen(square + place);
      weight += area;
    }
    GreyMoments moments;
    moments.x = static_cast<float>(sum.x() / weight), moments.y = static_cast<float>(sum.y() / weight);
    moments_.push_back(moments);
    truth_.push_back(seen(centroid));
    grid_.add(row, column, seen(square).cast<float>(), derivative(square).cast<float>());
    claims_.push_back({static_cast<std::int16_t>(row), static_cast<std::int16_t>(column), 20, RegionStatus::kDecoded});
  }

  Calibration rig_;
  Surface surface_;
  std::vector<Eigen::Vector2d> places_;
  SimulatedGrid grid_;
  std::vector<GreyMoments> moments_;
  std::vector<CellClaim> claims_;
  std::vector<Eigen::Vector2d> truth_;
};

/// Projector pixel that lights a place on the front of the cylinder.
Eigen::Vector2d lighting(double x_mm) {
  const Calibration rig = paper_rig();
  const Eigen::Vector3d point(x_mm, 0, 2000 - std::sqrt(150. * 150 - x_mm * x_mm));
  return rig.projector.project(rig.cameras[0].projector_from_camera * point);
}

TEST(CentreCorrection, HalvesTheErrorOnACylinder) {
  for (const int symbol : {7, 25, 22, 5}) {
    const Errors errors = Block(symbol, test::kCylinder).errors_around(lighting(20));
    EXPECT_GT(errors.before, 0.02) << symbol;
    EXPECT_LT(errors.after, 0.5 * errors.before) << symbol;
    EXPECT_LT(errors.after, 0.02) << symbol;
  }
}

TEST(CentreCorrection, ReducesTheErrorTowardsTheLimb) {
  const Errors errors = Block(7, test::kCylinder).errors_around(lighting(70));
  EXPECT_GT(errors.before, 0.03);
  EXPECT_LT(errors.after, 0.5 * errors.before);
}

// Camera and projector stand so near to each other that perspective hardly bends the map between them.
TEST(CentreCorrection, ReducesTheSmallErrorOfATiltedPlane) {
  const Errors errors = Block(7, plane({0, 0, 2000}, {1.7, 0, -1})).errors_around({640, 400});
  EXPECT_GT(errors.before, 0.001);
  EXPECT_LT(errors.after, 0.9 * errors.before);
  EXPECT_LT(errors.after, 0.004);
}

// By some thousandths of a pixel, and alike all over the plane, so that it stays however many symbols are averaged.
TEST(CentreCorrection, UndoesTheSlightBendOfPlanes) {
  for (const double tilt : {-0.6, 0., 0.6}) {
    const Errors errors = Block(7, plane({0, 0, 2000}, {tilt, 0, -1})).errors_around({640, 400});
    EXPECT_GT(errors.before, 0.003) << tilt;
    EXPECT_LT(errors.after, 0.2 * errors.before) << tilt;
  }
}

TEST(CentreCorrection, LeavesAFlatGridAlone) {
  const Errors errors = Block(7, plane({0, 0, 2000}, {0, 0, 1})).errors_around({640, 400});
  EXPECT_LT(errors.before, 0.01);
  EXPECT_LT(errors.after, 0.01);
}

TEST(CentreCorrection, LeavesOutWhatHasNoCell) {
  const std::vector<GridNode> nodes(1, GridNode{{10, 20}, LatticeFrame::Identity()});
  const std::vector<GreyMoments> moments(1);
  Lattice lattice;
  lattice.symbols.resize(1);
  CentreCorrection({exact_prototype(lit_places(7))}, 18, kSizePx)
      .correct(nodes, moments, {CellClaim{}}, {}, alone, lattice);
  EXPECT_TRUE(lattice.symbols.empty());
}

}  // namespace
}  // namespace slsd
