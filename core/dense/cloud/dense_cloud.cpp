// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/cloud/dense_cloud.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include <Eigen/Geometry>

#include "core/clones.hpp"
#include "core/cloud/dense_file.hpp"
#include "core/cloud/point_record.hpp"
#include "core/colour.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

static_assert(std::endian::native == std::endian::little, "the records are copied as they lie in memory");

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
/// Largest change of white by print and shading that most pixels have within the window of a fit.
constexpr double kWhiteOff = 0.3;

/// The points of a view in the file's frame, pixel by pixel.
class ViewPoints {
 public:
  ViewPoints(const DenseView& view, const RigidTransform& file_from_camera)
      : view_(view),
        rotation_(file_from_camera.rotation.cast<float>()),
        translation_(file_from_camera.translation.cast<float>()) {}

  [[nodiscard]] Eigen::Vector3f at(int x, int y) const {
    const float depth = view_.map.depth_mm[index(x, y)];
    const Eigen::Vector2f ray = view_.rays->at(x, y);
    return rotation_ * Eigen::Vector3f(ray.x() * depth, ray.y() * depth, depth) + translation_;
  }
  /// The unit normal towards the camera, from neighbours on the same surface; without these, the reversed ray.
  [[nodiscard]] Eigen::Vector3f normal(int x, int y) const {
    const Eigen::Vector3f here = at(x, y), to_camera = translation_ - here;
    const Eigen::Vector3f along = slope(x, y, 1, 0), down = slope(x, y, 0, 1);
    Eigen::Vector3f normal = along.cross(down);
    if (!(normal.squaredNorm() > 0)) return to_camera.normalized();
    normal.normalize();
    return normal.dot(to_camera) < 0 ? Eigen::Vector3f(-normal) : normal;
  }

 private:
  [[nodiscard]] std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * view_.map.width + x; }
  [[nodiscard]] bool joined(int x, int y, int to_x, int to_y) const {
    if (to_x < 0 || to_y < 0 || to_x >= view_.map.width || to_y >= view_.map.height) return false;
    const float depth = view_.map.depth_mm[index(x, y)], other = view_.map.depth_mm[index(to_x, to_y)];
    return std::abs(other - depth) < kDepthJump * depth;
  }
  [[nodiscard]] Eigen::Vector3f slope(int x, int y, int dx, int dy) const {
    const bool before = joined(x, y, x - dx, y - dy), behind = joined(x, y, x + dx, y + dy);
    const Eigen::Vector3f from = before ? at(x - dx, y - dy) : at(x, y), to = behind ? at(x + dx, y + dy) : at(x, y);
    return to - from;
  }

  const DenseView& view_;
  Eigen::Matrix3f rotation_;
  Eigen::Vector3f translation_;
};

void put(char*& to, const Eigen::Vector3f& vector) {
  std::memcpy(to, vector.data(), 12);
  to += 12;
}

/// Up to eight pixels of a row.
struct RowPiece {
  float turned[3], per_px[3];  // R r of the first pixel, and its change for one px
  float translation[3];
  const float* depth_mm;
  int count;
};

inline __attribute__((always_inline)) void place_lanes(const RowPiece& in, float* x, float* y, float* z) {
  Lanes depth{};
  std::memcpy(&depth, in.depth_mm, sizeof(float) * static_cast<std::size_t>(in.count));
  float* const to[3] = {x, y, z};
  for (int k = 0; k < 3; ++k) {
    const Lanes place = depth * (in.turned[k] + in.per_px[k] * kLane) + in.translation[k];
    std::memcpy(to[k], &place, sizeof place);
  }
}

/// Positions of the points of a view's row in the file's frame, the same for every format.
class RowPlaces {
 public:
  static_assert(RayGrid::kPitchPx == kLanes);  // rays between the stored ones lie on a line

  RowPlaces(const DenseView& view, const RigidTransform& file_from_camera)
      : view_(view), rotation_(file_from_camera.rotation.cast<float>()) {
    Eigen::Map<Eigen::Vector3f>(piece_.translation) = file_from_camera.translation.cast<float>();
    for (auto& of_axis : places_) of_axis.resize(static_cast<std::size_t>(view.map.width) + kLanes);
  }
  void place(int y) {
    for (int x = 0; x < view_.map.width; x += kLanes) {
      const Eigen::Vector2f first = view_.rays->at(x, y), last = view_.rays->before_next(x, y);
      Eigen::Map<Eigen::Vector3f>(piece_.turned) = rotation_ * first.homogeneous();
      Eigen::Map<Eigen::Vector3f>(piece_.per_px) = rotation_.leftCols<2>() * (last - first) / (RayGrid::kPitchPx - 1);
      piece_.depth_mm = &view_.map.depth_mm[static_cast<std::size_t>(y) * view_.map.width + x];
      piece_.count = std::min(kLanes, view_.map.width - x);
      Cloned<place_lanes>::call(piece_, &places_[0][x], &places_[1][x], &places_[2][x]);
    }
  }
  [[nodiscard]] Eigen::Vector3f at(int x) const { return {places_[0][x], places_[1][x], places_[2][x]}; }

 private:
  const DenseView& view_;
  Eigen::Matrix3f rotation_;
  RowPiece piece_{};
  std::array<std::vector<float>, 3> places_;
};

// Joins rows to pieces that stay in the processor's cache until the sink has taken them.
class PieceBuffer {
 public:
  explicit PieceBuffer(ByteSink& sink) : sink_(sink) {}
  // @return the place for the next row, of at most so many bytes
  [[nodiscard]] char* room(std::size_t row_bytes) {
    if (filled_ + row_bytes > bytes_.size()) {
      flush();
      if (row_bytes > bytes_.size()) bytes_.resize(std::max(kPieceBytes, row_bytes));
    }
    return bytes_.data() + filled_;
  }
  void fill_to(const char* end) { filled_ = static_cast<std::size_t>(end - bytes_.data()); }
  void flush() {
    if (filled_ > 0) sink_.take({bytes_.data(), filled_});
    filled_ = 0;
  }

 private:
  static constexpr std::size_t kPieceBytes = 256 << 10U;
  ByteSink& sink_;
  std::vector<char> bytes_;
  std::size_t filled_ = 0;
};

template <class Value>
void put(char*& to, Value value) {
  std::memcpy(to, &value, sizeof value);
  to += sizeof value;
}

/// @tparam Intensity  type in which the format stores it
/// @param row         row y
template <class Intensity>
void put_point(char*& to, const DenseView& view, const RowPlaces& row, const ViewPoints& points, int x, int y,
               bool normals) {
  const std::size_t pixel = static_cast<std::size_t>(y) * view.map.width + x;
  put(to, row.at(x));
  put(to, view.map.sigma_mm[pixel]);
  put(to, static_cast<Intensity>(view.map.intensity[pixel]));
  put(to, view.camera);
  if (normals) put(to, points.normal(x, y));
}

/// Tells whether a pixel of the image has a point.
bool has_point(const DenseView& view, int x, int y) {
  return x < view.map.width && view.map.measured(static_cast<std::size_t>(y) * view.map.width + x);
}

Rgb colour_at(const DenseView& view, int x, int y) {
  return view.colours.empty() ? Rgb{} : view.colours[static_cast<std::size_t>(y) * view.map.width + x];
}

DenseFacts facts_of(const DenseCloud& cloud, bool normals, const RigidTransform* base_from_rig) {
  return {cloud.scan_id,      cloud.time, cloud.frame,
          cloud.views.size(), normals,    base_from_rig ? std::optional(*base_from_rig) : std::nullopt,
          cloud.coloured()};
}

RigidTransform file_from_camera(const DenseView& view, const RigidTransform* base_from_rig) {
  return base_from_rig == nullptr ? view.rig_from_camera : base_from_rig->after(view.rig_from_camera);
}

}  // namespace

std::size_t DenseCloud::points() const {
  std::size_t count = 0;
  for (const DenseView& view : views) count += view.map.count(DensePixel::kMeasured);
  return count;
}

bool DenseCloud::coloured() const {
  return std::ranges::any_of(views, [](const DenseView& view) { return !view.colours.empty(); });
}

std::size_t DenseCloud::bytes() const {
  std::size_t bytes = 0;
  for (const DenseView& view : views)
    bytes += view.map.pixels.size() * (2 * sizeof(float) + 2) + view.colours.size() * sizeof(Rgb);
  return bytes;
}

std::size_t shade_view(DenseView& view, const SceneLight& light, bool coloured) {
  std::size_t saturated = 0;
  const auto level = [](const GreyView& frame, int x, int y) {
    return std::visit([&](const auto& pixels) { return static_cast<double>(pixels.at(x, y)); }, frame);
  };
  // Ratio of the white frame to what the pattern's frame predicts, in steps of 1/32 up to 4. The usual ratio is due to
  // the light.
  constexpr int kSteps = 128, kPerUnit = 32;
  std::array<std::size_t, kSteps> ratios{};
  view.colours.assign(coloured ? view.map.pixels.size() : 0, Rgb{});
  const auto sample = [](const ColourFrame* colours, int x, int y) {
    ColourSample taken;
    if (colours == nullptr) return taken;
    std::ranges::copy(colours->at(x, y), taken.levels.begin());
    taken.highest = std::ranges::max(taken.levels);
    return taken;
  };
  for (int y = 0; y < view.map.height; ++y) {
    for (int x = 0; x < view.map.width; ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * view.map.width + x;
      if (!view.map.measured(pixel)) continue;
      const double dark = light.dark ? level(*light.dark, x, y) : 0;
      const double of_pattern = view.map.intensity[pixel] / 255.0 * light.full;
      const double white = light.white ? level(*light.white, x, y) : of_pattern;
      const bool clipped = light.white && white >= kSaturatedShare * light.full;
      bool unknown = clipped;
      if (!clipped) ++ratios[std::min(kSteps - 1, static_cast<int>(kPerUnit * white / std::max(of_pattern, 1.0)))];
      const double share = clipped ? 1 : (white - dark) / light.full;
      const auto intensity = static_cast<std::uint8_t>(std::lround(std::clamp(255 * share, 0.0, 255.0)));
      view.map.intensity[pixel] = intensity;
      if (coloured)
        view.colours[pixel] =
            light.white_colours == nullptr
                ? grey_of(intensity)
                : colour_of(sample(light.white_colours, x, y), sample(light.dark_colours, x, y), light, unknown);
      saturated += unknown;
    }
  }
  std::size_t all = 0, usual = 0;
  for (const std::size_t count : ratios) all += count;
  if (!light.white || all == 0) return saturated;
  std::size_t below = 0;
  int middle = 0;
  while (middle + 1 < kSteps && 2 * (below + ratios[middle]) < all) below += ratios[middle++];
  const double usual_ratio = (middle + 0.5) / kPerUnit;
  for (int step = 0; step < kSteps; ++step)
    if (std::abs((step + 0.5) / kPerUnit - usual_ratio) <= std::max(kWhiteOff * usual_ratio, 1.5 / kPerUnit))
      usual += ratios[step];
  view.white_differs = static_cast<double>(all - usual) / static_cast<double>(all);
  return saturated;
}

void write_dense_ply(const DenseCloud& cloud, bool normals, const RigidTransform* base_from_rig, ByteSink& sink) {
  const std::size_t points = cloud.points();
  const std::string header = dense_ply_header(facts_of(cloud, normals, base_from_rig), points);
  const bool coloured = cloud.coloured();
  const std::size_t record = dense_ply_bytes(normals, coloured);
  sink.expect(header.size() + points * record);
  sink.take(header);
  PieceBuffer buffer(sink);
  for (const DenseView& view : cloud.views) {
    const RigidTransform place = file_from_camera(view, base_from_rig);
    const ViewPoints normal_points(view, place);
    RowPlaces places(view, place);
    for (int y = 0; y < view.map.height; ++y) {
      places.place(y);
      char* to = buffer.room(static_cast<std::size_t>(view.map.width) * record);
      for (int x = 0; x < view.map.width; ++x)
        if (has_point(view, x, y)) {
          put_point<std::uint8_t>(to, view, places, normal_points, x, y, normals);
          if (coloured) put(to, colour_at(view, x, y));
        }
      buffer.fill_to(to);
    }
  }
  buffer.flush();
}

void write_dense_pcd(const DenseCloud& cloud, bool normals, const RigidTransform* base_from_rig, ByteSink& sink) {
  int width = 0, height = 0;
  for (const DenseView& view : cloud.views) width = std::max(width, view.map.width), height += view.map.height;
  const std::string header = dense_pcd_header(facts_of(cloud, normals, base_from_rig), width, height);
  const bool coloured = cloud.coloured();
  const std::size_t row_bytes = width * dense_pcd_bytes(normals, coloured);
  sink.expect(header.size() + height * row_bytes);
  sink.take(header);
  PieceBuffer buffer(sink);
  const Eigen::Vector3f none = Eigen::Vector3f::Constant(kNone);
  for (const DenseView& view : cloud.views) {
    const RigidTransform place = file_from_camera(view, base_from_rig);
    const ViewPoints points(view, place);
    RowPlaces places(view, place);
    for (int y = 0; y < view.map.height; ++y) {
      places.place(y);
      char* to = buffer.room(row_bytes);
      for (int x = 0; x < width; ++x) {
        if (has_point(view, x, y)) {
          put_point<float>(to, view, places, points, x, y, normals);
          if (coloured) put(to, packed(colour_at(view, x, y)));
          continue;
        }
        put(to, none);
        put(to, none.x());
        put(to, 0.0F);
        put(to, view.camera);
        if (normals) put(to, none);
        if (coloured) put(to, packed(Rgb{}));
      }
      buffer.fill_to(to);
    }
  }
  buffer.flush();
}

namespace {

/// A baseline TIFF with pages of floats: TIFF 6.0, sections 2 and 19.
class FloatPages {
 public:
  void add(const std::vector<float>& pixels, int width, int height, const std::string& description) {
    const std::size_t data = bytes_.size();
    bytes_.append(reinterpret_cast<const char*>(pixels.data()), pixels.size() * sizeof(float));
    const std::size_t text = bytes_.size();
    bytes_ += description + std::string(2 - description.size() % 2, '\0');  // ends in a zero byte, on a word boundary
    const auto at = static_cast<std::uint32_t>(bytes_.size());
    std::memcpy(bytes_.data() + link_, &at, 4);
    constexpr std::uint16_t kShort = 3, kLong = 4, kAscii = 2;
    word(11);
    entry(256, kLong, 1, static_cast<std::uint32_t>(width));
    entry(257, kLong, 1, static_cast<std::uint32_t>(height));
    entry(258, kShort, 1, 32);  // bits
    entry(259, kShort, 1, 1);   // not compressed
    entry(262, kShort, 1, 1);   // black is zero
    entry(270, kAscii, static_cast<std::uint32_t>(description.size() + 1), static_cast<std::uint32_t>(text));
    entry(273, kLong, 1, static_cast<std::uint32_t>(data));
    entry(277, kShort, 1, 1);
    entry(278, kLong, 1, static_cast<std::uint32_t>(height));
    entry(279, kLong, 1, static_cast<std::uint32_t>(pixels.size() * sizeof(float)));
    entry(339, kShort, 1, 3);  // IEEE floats
    link_ = bytes_.size();
    number(0);
  }
  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  void word(std::uint16_t value) { bytes_.append(reinterpret_cast<const char*>(&value), sizeof value); }
  void number(std::uint32_t value) { bytes_.append(reinterpret_cast<const char*>(&value), sizeof value); }
  void entry(std::uint16_t tag, std::uint16_t type, std::uint32_t count, std::uint32_t value) {
    word(tag), word(type), number(count), number(value);
  }

  std::string bytes_ = std::string("II*\0\0\0\0\0", 8);
  std::size_t link_ = 4;  // position of the next page's offset
};

}  // namespace

std::string write_dense_tiff(const DenseCloud& cloud) {
  FloatPages pages;
  for (const DenseView& view : cloud.views) {
    const std::string of = "scan " + header_text(cloud.scan_id) + ", " + header_text(cloud.time) + ", frame " +
                           std::to_string(cloud.frame) + ", camera " + header_text(view.camera_name) + ": ";
    pages.add(view.map.depth_mm, view.map.width, view.map.height, of + "Z in mm, in the frame of this camera");
    pages.add(view.map.sigma_mm, view.map.width, view.map.height, of + "sigma_mm");
  }
  return pages.take();
}

}  // namespace slsd
