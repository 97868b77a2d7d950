// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/mesh/volume.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <openvdb/openvdb.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/parallel_for.h>
#include <Eigen/Geometry>

#include "clients/model/mesh/close_field.hpp"
#include "clients/model/range_image.hpp"
#include "core/colour.hpp"
#include "core/mesh/mesh.hpp"

namespace slsd::model {
namespace {

using openvdb::Coord;
using FloatLeaf = openvdb::FloatTree::LeafNodeType;
using FactsLeaf = openvdb::Int32Tree::LeafNodeType;

constexpr int kLeafSide = 8;
/// A voxel that more frames saw through than measured is empty.
constexpr unsigned kSeenThrough = 1;
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr float kInventedIntensity = 128;

/// Besides its distance and weight, what is known of a voxel.
struct VoxelFacts {
  unsigned measured = 0;   ///< frames that have a surface near it
  unsigned passed = 0;     ///< frames whose light passed through it
  unsigned intensity = 0;  ///< mean, 0 to 255

  static constexpr unsigned kMost = 0xfff;
  static VoxelFacts of(std::int32_t packed) {
    const auto bits = static_cast<std::uint32_t>(packed);
    return {bits & kMost, bits >> 12 & kMost, bits >> 24};
  }
  [[nodiscard]] std::int32_t packed() const {
    return static_cast<std::int32_t>(std::min(measured, kMost) | std::min(passed, kMost) << 12 | intensity << 24);
  }
  [[nodiscard]] bool empty() const { return passed > kSeenThrough * measured; }
};

/// A voxel's place on a surface: the plane of the pixel that sees it.
struct PixelPlane {
  Eigen::Vector3f place, normal;  // camera's frame
  float sigma_mm = 0;             // along the normal; 0: no surface
};

/// One camera's surface, ready to be looked up.
class SurfaceLookup {
 public:
  SurfaceLookup(const SurfaceView& view, const RigidTransform& object_from_rig)
      : image_(view.image),
        tile_columns_((view.image.width + kTilePx - 1) / kTilePx),
        tile_rows_((view.image.height + kTilePx - 1) / kTilePx),
        planes_(view.image.depth_mm.size()),
        farthest_of_tile_(static_cast<std::size_t>(tile_columns_) * tile_rows_) {
    const RigidTransform camera_from_object = view.image.camera_from_rig.after(object_from_rig.inverse());
    rotation_ = camera_from_object.rotation.cast<float>(), translation_ = camera_from_object.translation.cast<float>();
    const Eigen::Matrix3f camera_rotation = view.image.camera_from_rig.rotation.cast<float>();
    for (int y = 0; y < image_.height; ++y) {
      for (int x = 0; x < image_.width; ++x) {
        const std::size_t pixel = image_.index(x, y);
        if (std::isnan(image_.depth_mm[pixel])) continue;
        const Eigen::Vector2d ray = image_.lens.undistort(Eigen::Vector2d(x + image_.left, y + image_.top));
        const Eigen::Vector3f unit = ray.homogeneous().cast<float>();
        const SurfaceCell* const cell =
            cell_near(view.levels.back(), x, y,
                      view.image.camera_from_rig.inverse() * (unit * image_.depth_mm[pixel]).cast<double>());
        if (!cell) continue;
        const Eigen::Vector3f normal = camera_rotation * cell->normal;
        const float cosine = -normal.dot(unit) / unit.norm();
        planes_[pixel] = {unit * image_.depth_mm[pixel], normal, image_.sigma_mm[pixel] * std::max(cosine, 0.1F)};
        float& farthest = farthest_of_tile_[static_cast<std::size_t>(y / kTilePx) * tile_columns_ +
                                            static_cast<std::size_t>(x / kTilePx)];
        farthest = std::max(farthest, image_.depth_mm[pixel]);
      }
    }
  }

  [[nodiscard]] const RangeImage& image() const { return image_; }
  [[nodiscard]] Eigen::Vector3f in_camera(const Eigen::Vector3f& in_object) const {
    return rotation_ * in_object + translation_;
  }
  [[nodiscard]] const Eigen::Matrix3f& rotation() const { return rotation_; }
  /// The plane of the pixel that sees this place; nothing if it measured none.
  [[nodiscard]] const PixelPlane* at(const Eigen::Vector3f& place) const {
    const Eigen::Vector2f pixel = image_.pixel_of(place);
    const float x = pixel.x() + 0.5F, y = pixel.y() + 0.5F;
    if (!(x >= 0 && y >= 0 && x < static_cast<float>(image_.width) && y < static_cast<float>(image_.height)))
      return nullptr;
    const PixelPlane& plane = planes_[image_.index(static_cast<int>(x), static_cast<int>(y))];
    return plane.sigma_mm > 0 ? &plane : nullptr;
  }
  [[nodiscard]] std::uint8_t intensity_of(const PixelPlane& plane) const {
    return image_.intensity[static_cast<std::size_t>(&plane - planes_.data())];
  }
  /// The colour; of a cloud without colours, the intensity.
  [[nodiscard]] Rgb colour_of(const PixelPlane& plane) const {
    return image_.colours.empty() ? grey_of(intensity_of(plane))
                                  : image_.colours[static_cast<std::size_t>(&plane - planes_.data())];
  }
  /// Greatest depth of the surface in a square of pixels, mm; 0 if nothing is measured there. It may reach over the
  /// square by a tile.
  [[nodiscard]] float farthest_mm(const Eigen::Vector2f& middle_px, float radius_px) const {
    const auto tile = [](float px, int tiles) {
      return std::clamp(static_cast<int>(std::floor(px / kTilePx)), 0, tiles - 1);
    };
    float farthest = 0;
    for (int row = tile(middle_px.y() - radius_px, tile_rows_); row <= tile(middle_px.y() + radius_px, tile_rows_);
         ++row)
      for (int column = tile(middle_px.x() - radius_px, tile_columns_);
           column <= tile(middle_px.x() + radius_px, tile_columns_); ++column)
        farthest = std::max(farthest, farthest_of_tile_[static_cast<std::size_t>(row) * tile_columns_ + column]);
    return farthest;
  }
  /// Calls visit(place in the object's frame) along the ray of every second measured pixel, within the band.
  template <class Visit>
  void visit_band(float band_mm, float step_mm, Visit&& visit) const {
    const Eigen::Matrix3f back = rotation_.transpose();
    for (int y = 0; y < image_.height; y += 2) {
      for (int x = y / 2 % 2; x < image_.width; x += 2) {
        const PixelPlane& plane = planes_[image_.index(x, y)];
        if (!(plane.sigma_mm > 0)) continue;
        for (float along = -band_mm; along < band_mm + step_mm; along += step_mm)
          visit(Eigen::Vector3f(back * (plane.place + std::min(along, band_mm) * plane.normal - translation_)));
      }
    }
  }

 private:
  /// The pixel's cell; where that has no plane, the nearest of the cells around it.
  static const SurfaceCell* cell_near(const CellGrid& grid, int x, int y, const Eigen::Vector3d& place) {
    const auto at = [&](int right, int down) {
      return grid.at(static_cast<float>(x + right * grid.step), static_cast<float>(y + down * grid.step));
    };
    if (const SurfaceCell* const own = at(0, 0)) return own;
    const SurfaceCell* nearest = nullptr;
    float least = 0.01F * static_cast<float>(place.z());
    for (int down = -1; down <= 1; ++down) {
      for (int right = -1; right <= 1; ++right) {
        const SurfaceCell* const cell = at(right, down);
        const float distance = cell ? (cell->place_mm - place.cast<float>()).norm() : least;
        if (distance < least) nearest = cell, least = distance;
      }
    }
    return nearest;
  }

  static constexpr int kTilePx = 8;

  const RangeImage& image_;
  Eigen::Matrix3f rotation_;
  Eigen::Vector3f translation_;
  int tile_columns_, tile_rows_;
  std::vector<PixelPlane> planes_;
  std::vector<float> farthest_of_tile_;  // depth, mm
};

/// A voxel so many bands behind the surface, along the camera's axis, is hidden.
constexpr float kHiddenBands = 3;

struct Leaves {
  FloatLeaf* distance;
  FloatLeaf* weight;
  FactsLeaf* facts;
  FactsLeaf* colour;  ///< null: no shot had colours
};

/// Moves the mean colour of a voxel towards another by its share. A voxel without one begins with its intensity.
void blend_colour(FactsLeaf& leaf, openvdb::Index at, unsigned intensity, const Rgb& seen, float share) {
  Rgb mean = leaf.isValueOn(at) ? unpacked(static_cast<std::uint32_t>(leaf.getValue(at)))
                                : grey_of(static_cast<std::uint8_t>(intensity));
  for (std::size_t i = 0; i < mean.size(); ++i) {
    const float level = mean[i];
    mean[i] = static_cast<std::uint8_t>(std::lround(level + share * (static_cast<float>(seen[i]) - level)));
  }
  leaf.setValueOn(at, static_cast<std::int32_t>(packed(mean)));
}

/// Adds what a surface says of one voxel.
void add_to_voxel(const Leaves& leaves, openvdb::Index at, const SurfaceLookup& surface, const Eigen::Vector3f& place,
                  float band_mm) {
  const PixelPlane* const plane = surface.at(place);
  if (!plane) return;
  const float before_mm = plane->place.z() - place.z();  // along the camera's axis
  const float off_mm = plane->normal.dot(place - plane->place);
  if (off_mm < -band_mm || before_mm < -kHiddenBands * band_mm) return;  // hidden
  VoxelFacts facts = VoxelFacts::of(leaves.facts->getValue(at));
  if (off_mm > band_mm || before_mm > kHiddenBands * band_mm) {
    facts.passed += facts.passed < VoxelFacts::kMost ? 1 : 0;
  } else {
    // Deep below the surface, another side of the object may be nearer.
    const float depth_share = std::clamp(2 + 2 * off_mm / band_mm, 0.0F, 1.0F);
    const float weight = depth_share / (plane->sigma_mm * plane->sigma_mm);
    const float before = leaves.weight->getValue(at), sum = before + weight;
    if (!(sum > 0)) return;
    const float share = weight / sum;
    const float mean = before > 0 ? leaves.distance->getValue(at) : 0;
    leaves.distance->setValueOn(at, mean + share * (off_mm - mean));
    leaves.weight->setValueOn(at, sum);
    if (leaves.colour) blend_colour(*leaves.colour, at, facts.intensity, surface.colour_of(*plane), share);
    const float level = static_cast<float>(facts.intensity);
    facts.intensity =
        static_cast<unsigned>(std::lround(level + share * (static_cast<float>(surface.intensity_of(*plane)) - level)));
    facts.measured += facts.measured < VoxelFacts::kMost ? 1 : 0;
  }
  leaves.facts->setValueOn(at, facts.packed());
}

void add_to_leaf(const Leaves& leaves, const SurfaceLookup& surface, const VolumeOptions& options) {
  const Coord& origin = leaves.distance->origin();
  const Eigen::Vector3f corner = surface.in_camera(
      Eigen::Vector3f(static_cast<float>(origin.x()), static_cast<float>(origin.y()), static_cast<float>(origin.z())) *
      options.voxel_mm);
  const Eigen::Matrix3f step = surface.rotation() * options.voxel_mm;
  if (!(corner.z() > kLeafSide * 2 * options.voxel_mm)) return;
  const Eigen::Vector3f middle = corner + step * Eigen::Vector3f::Constant(kLeafSide / 2.0F);
  const Eigen::Vector2f pixel = surface.image().pixel_of(middle);
  const float radius = kLeafSide * options.voxel_mm / middle.z() *
                       static_cast<float>(std::max(surface.image().lens.fx, surface.image().lens.fy));
  if (pixel.x() < -radius || pixel.y() < -radius || pixel.x() > static_cast<float>(surface.image().width) + radius ||
      pixel.y() > static_cast<float>(surface.image().height) + radius)
    return;
  // Half of the object lies behind what the camera sees. A lens may widen the square.
  const float nearest_mm = middle.z() - kLeafSide * options.voxel_mm;
  if (surface.farthest_mm(pixel, 1.5F * radius + 1) < nearest_mm - kHiddenBands * options.band_mm) return;
  for (int i = 0; i < kLeafSide; ++i)
    for (int j = 0; j < kLeafSide; ++j)
      for (int k = 0; k < kLeafSide; ++k)
        add_to_voxel(
            leaves, FloatLeaf::coordToOffset(Coord(i, j, k)), surface,
            corner + step * Eigen::Vector3f(static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)),
            options.band_mm);
}

}  // namespace

struct Volume::Grids {
  openvdb::FloatGrid distance, weight;
  openvdb::Int32Grid facts, colour;
  bool coloured = false;

  [[nodiscard]] const openvdb::Int32Grid* colours() const { return coloured ? &colour : nullptr; }
  [[nodiscard]] Leaves touch(const Coord& at) {
    return {distance.tree().touchLeaf(at), weight.tree().touchLeaf(at), facts.tree().touchLeaf(at),
            coloured ? colour.tree().touchLeaf(at) : nullptr};
  }
  /// Calls visit(leaf of the field, offset, distance, facts) for each voxel that light met or passed.
  template <class Visit>
  void visit(Visit&& visit, openvdb::FloatGrid& field) const {
    for (auto leaf = distance.tree().cbeginLeaf(); leaf; ++leaf) {
      const FactsLeaf* const about = facts.tree().probeConstLeaf(leaf->origin());
      FloatLeaf* const to = field.tree().touchLeaf(leaf->origin());
      for (auto voxel = about->cbeginValueOn(); voxel; ++voxel)
        visit(*to, voxel.pos(), leaf->getValue(voxel.pos()), VoxelFacts::of(*voxel));
    }
  }
  [[nodiscard]] std::vector<Leaves> leaves() {
    std::vector<Leaves> all;
    for (auto leaf = distance.tree().beginLeaf(); leaf; ++leaf) all.push_back(touch(leaf->origin()));
    return all;
  }
};

Volume::Volume(const VolumeOptions& options) : options_(options) {
  openvdb::initialize();
  grids_ = std::make_unique<Grids>();
}
Volume::Volume(Volume&&) noexcept = default;
Volume& Volume::operator=(Volume&&) noexcept = default;
Volume::~Volume() = default;

std::size_t Volume::voxels() const {
  return grids_->weight.activeVoxelCount();
}
std::size_t Volume::bytes() const {
  return grids_->distance.memUsage() + grids_->weight.memUsage() + grids_->facts.memUsage() +
         (grids_->coloured ? grids_->colour.memUsage() : 0);
}

void Volume::add(const Shot& shot, const RigidTransform& object_from_rig) {
  for (const SurfaceView& view : shot.views) {
    const SurfaceLookup surface(view, object_from_rig);
    grids_->coloured = grids_->coloured || !view.image.colours.empty();
    Coord last(std::numeric_limits<int>::max());
    surface.visit_band(options_.band_mm, kLeafSide * options_.voxel_mm / 2, [&](const Eigen::Vector3f& place) {
      const Eigen::Vector3f voxel = place / options_.voxel_mm;
      const Coord at(static_cast<int>(std::lround(voxel.x())), static_cast<int>(std::lround(voxel.y())),
                     static_cast<int>(std::lround(voxel.z())));
      const Coord origin = at & ~(kLeafSide - 1);
      if (origin == last) return;
      last = origin;
      static_cast<void>(grids_->touch(origin));
    });
    const std::vector<Leaves> leaves = grids_->leaves();
    tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) { add_to_leaf(leaves[i], surface, options_); });
  }
}

namespace {

/// The voxels around a place, and how much each counts.
struct Corner {
  Coord at;
  float share;
};
std::array<Corner, 8> corners_of(const Eigen::Vector3f& voxel) {
  const Eigen::Vector3f low = voxel.array().floor(), part = voxel - low;
  std::array<Corner, 8> corners;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3i up(i & 1, i >> 1 & 1, i >> 2 & 1);
    const Eigen::Vector3f share =
        up.cast<float>().cwiseProduct(part) +
        (Eigen::Vector3f::Ones() - up.cast<float>()).cwiseProduct(Eigen::Vector3f::Ones() - part);
    const Eigen::Vector3i at = low.cast<int>() + up;
    corners[static_cast<std::size_t>(i)] = {Coord(at.x(), at.y(), at.z()), share.prod()};
  }
  return corners;
}

/// Reads what was measured around vertices.
class VertexReader {
 public:
  /// @param colour  null: no shot had colours
  VertexReader(const openvdb::FloatGrid& weight, const openvdb::Int32Grid& facts, const openvdb::Int32Grid* colour,
               unsigned fewest_frames)
      : weight_(weight.getConstAccessor()), facts_(facts.getConstAccessor()), fewest_frames_(fewest_frames) {
    if (colour) colour_.emplace(colour->getConstAccessor());
  }

  struct Vertex {
    float sigma_mm, frames, intensity;
    Eigen::Vector3f colour;
  };
  [[nodiscard]] bool coloured() const { return colour_.has_value(); }
  /// Nothing if the voxels around it were not all measured.
  [[nodiscard]] std::optional<Vertex> read(const Eigen::Vector3f& voxel) {
    float weights = 0, frames = 0, intensity = 0;
    Eigen::Vector3f colour = Eigen::Vector3f::Zero();
    for (const Corner& corner : corners_of(voxel)) {
      const VoxelFacts facts = VoxelFacts::of(facts_.getValue(corner.at));
      if (facts.measured < fewest_frames_ || facts.empty()) return std::nullopt;
      weights += corner.share * weight_.getValue(corner.at);
      frames += corner.share * static_cast<float>(facts.measured);
      intensity += corner.share * static_cast<float>(facts.intensity);
      if (!colour_) continue;
      std::int32_t number = 0;
      const Rgb seen = colour_->probeValue(corner.at, number) ? unpacked(static_cast<std::uint32_t>(number))
                                                              : grey_of(static_cast<std::uint8_t>(facts.intensity));
      colour += corner.share * Eigen::Vector3f(seen[0], seen[1], seen[2]);
    }
    return Vertex{1 / std::sqrt(weights), frames, intensity, colour};
  }

 private:
  openvdb::FloatGrid::ConstAccessor weight_;
  openvdb::Int32Grid::ConstAccessor facts_;
  std::optional<openvdb::Int32Grid::ConstAccessor> colour_;
  unsigned fewest_frames_;
};

/// Cuts quads along their shorter diagonal.
/// @param vertex  of each of their corners; kNone: the quad is left out
void add_quads(const std::vector<openvdb::Vec4I>& quads, const std::vector<std::uint32_t>& vertex, Mesh& mesh) {
  for (const openvdb::Vec4I& quad : quads) {
    std::array<std::uint32_t, 4> corner;
    for (int i = 0; i < 4; ++i) corner[static_cast<std::size_t>(i)] = vertex[quad[i]];
    if (std::ranges::find(corner, kNone) != corner.end()) continue;
    const auto length = [&](std::size_t from, std::size_t to) {
      return (mesh.vertices_mm[corner[from]] - mesh.vertices_mm[corner[to]]).squaredNorm();
    };
    if (length(0, 2) < length(1, 3)) {
      mesh.triangles.push_back({corner[0], corner[1], corner[2]});
      mesh.triangles.push_back({corner[0], corner[2], corner[3]});
    } else {
      mesh.triangles.push_back({corner[0], corner[1], corner[3]});
      mesh.triangles.push_back({corner[1], corner[2], corner[3]});
    }
  }
}

/// Extracts the surface of a field. @param invent  also where nothing was measured
Mesh extract(const openvdb::FloatGrid& field, VertexReader reader, float voxel_mm, bool invent) {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(field, points, quads);
  Mesh mesh;
  std::vector<std::uint32_t> kept(points.size(), kNone);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f voxel(points[i].x(), points[i].y(), points[i].z());
    auto vertex = reader.read(voxel);
    if (!vertex && !invent) continue;
    if (!vertex)
      vertex = {std::numeric_limits<float>::quiet_NaN(), 0, kInventedIntensity,
                Eigen::Vector3f::Constant(kInventedIntensity)};
    kept[i] = static_cast<std::uint32_t>(mesh.vertices_mm.size());
    mesh.vertices_mm.push_back(voxel * voxel_mm);
    mesh.sigma_mm.push_back(vertex->sigma_mm);
    mesh.frames.push_back(static_cast<std::uint16_t>(std::lround(vertex->frames)));
    mesh.intensity.push_back(static_cast<std::uint8_t>(std::lround(vertex->intensity)));
    if (reader.coloured()) mesh.colours.push_back(to_rgb(vertex->colour));
  }
  add_quads(quads, kept, mesh);
  return mesh;
}

}  // namespace

Mesh Volume::mesh() const {
  // Outside of the band is far outside: what is not measured must have one sign.
  openvdb::FloatGrid field(options_.band_mm);
  grids_->visit(
      [&](FloatLeaf& to, openvdb::Index at, float distance_mm, const VoxelFacts& facts) {
        if (!facts.empty()) to.setValueOn(at, distance_mm);
      },
      field);
  return extract(field, {grids_->weight, grids_->facts, grids_->colours(), options_.fewest_frames}, options_.voxel_mm,
                 false);
}

Mesh Volume::closed_mesh() const {
  openvdb::FloatGrid known(options_.band_mm);
  grids_->visit(
      [&](FloatLeaf& to, openvdb::Index at, float distance_mm, const VoxelFacts& facts) {
        if (facts.empty()) {
          if (facts.passed > 1) to.setValueOn(at, options_.band_mm);
        } else if (facts.measured >= options_.fewest_frames) {
          to.setValueOn(at, distance_mm);
        }
      },
      known);
  return extract(*close_field(known), {grids_->weight, grids_->facts, grids_->colours(), options_.fewest_frames},
                 options_.voxel_mm, true);
}

}  // namespace slsd::model
