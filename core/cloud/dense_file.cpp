// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/cloud/dense_file.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include "core/cloud/coordinate_frame.hpp"
#include "core/cloud/point_record.hpp"
#include "core/colour.hpp"

namespace slsd {
namespace {

constexpr std::string_view kUnitsLine = "units mm\n", kDataBegins = "\nDATA binary\n";
constexpr std::size_t kDepthAt = 8, kSigmaAt = 12, kIntensityAt = 16, kCameraAt = 20;  // in a PCD's record

float float_at(std::string_view record, std::size_t at) {
  float value;
  std::memcpy(&value, record.data() + at, sizeof value);
  return value;
}

bool is_measured(std::string_view record) {
  return !std::isnan(float_at(record, kDepthAt));
}

std::uint8_t intensity_of(std::string_view record) {
  const float level = float_at(record, kIntensityAt);
  return static_cast<std::uint8_t>(level > 0 ? std::min(level, 255.F) : 0);
}

const RigidTransform* frame_of(const DenseFacts& facts) {
  return facts.base_from_rig ? &*facts.base_from_rig : nullptr;
}

/// The facts in both formats: a comment for each, after the format's mark.
std::string comments(std::string_view mark, const DenseFacts& facts) {
  std::string lines;
  const auto add = [&](std::string_view text) { lines.append(mark).append(text); };
  add("scan_id " + header_text(facts.scan_id) + "\n");
  add("time " + header_text(facts.time) + "\n");
  add("frame " + std::to_string(facts.frame) + "\n");
  add(kUnitsLine);
  return lines + frame_lines(mark, frame_of(facts));
}

int number_after(std::string_view header, std::string_view key) {
  const std::size_t at = header.find(key);
  int number = 0;
  if (at != std::string_view::npos)
    std::from_chars(header.data() + at + key.size(), header.data() + header.size(), number);
  return number;
}

}  // namespace

std::string dense_ply_header(const DenseFacts& facts, std::size_t points) {
  return "ply\nformat binary_little_endian 1.0\n" + comments("comment ", facts) + "comment cameras " +
         std::to_string(facts.cameras) + "\nelement vertex " + std::to_string(points) +
         "\nproperty float x\nproperty float y\nproperty float z\nproperty float sigma_mm\nproperty uchar intensity\n"
         "property uchar camera\n" +
         (facts.normals ? "property float nx\nproperty float ny\nproperty float nz\n" : "") +
         std::string(facts.coloured ? kPlyColourLines : "") + "end_header\n";
}

std::string dense_pcd_header(const DenseFacts& facts, int width, int height) {
  std::string names = "FIELDS x y z sigma_mm intensity camera", sizes = "SIZE 4 4 4 4 4 1", types = "TYPE F F F F F U",
              counts = "COUNT 1 1 1 1 1 1";
  const auto add = [&](std::string_view name) {
    names.append(" ").append(name);
    sizes += " 4", types += " F", counts += " 1";
  };
  if (facts.normals)
    for (const std::string_view axis : {"normal_x", "normal_y", "normal_z"}) add(axis);
  if (facts.coloured) add(kPcdColour.name);
  const std::string fields = names + "\n" + sizes + "\n" + types + "\n" + counts + "\n";
  return "# .PCD v0.7 - Point Cloud Data file format\n" + comments("# ", facts) + "VERSION 0.7\n" + fields + "WIDTH " +
         std::to_string(width) + "\nHEIGHT " + std::to_string(height) + "\n" + viewpoint_line(frame_of(facts)) +
         "POINTS " + std::to_string(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) +
         std::string(kDataBegins);
}

std::size_t dense_ply_bytes(bool normals, bool coloured) {
  return kDensePlyBytes + (normals ? kDenseNormalBytes : 0) + (coloured ? kPlyColourBytes : 0);
}

std::size_t dense_pcd_bytes(bool normals, bool coloured) {
  return kDensePcdBytes + (normals ? kDenseNormalBytes : 0) + (coloured ? kPcdColourBytes : 0);
}

Result<DensePcd> DensePcd::open(std::string_view bytes, int height, bool normals) {
  const std::size_t end = bytes.find(kDataBegins);
  const int width = end == std::string_view::npos ? 0 : number_after(bytes.substr(0, end), "\nWIDTH ");
  if (width <= 0 || height <= 0)
    return fail(ErrorCode::kMalformed, "the cloud is no organised PCD: its header has no size");
  const std::string_view fields = bytes.substr(0, end);
  const std::size_t named = fields.find("\nFIELDS ");
  const bool coloured = named != std::string_view::npos &&
                        fields.substr(0, fields.find('\n', named + 1)).ends_with(" " + std::string(kPcdColour.name));
  DensePcd cloud(bytes.substr(end + kDataBegins.size()), width, height, normals, coloured);
  cloud.base_from_rig_ = base_from_rig_of(bytes.substr(0, end));
  if (cloud.records_.size() / cloud.record_bytes() < cloud.pixels())
    return fail(ErrorCode::kMalformed, "the cloud has fewer points than its header says");
  return cloud;
}

std::size_t DensePcd::record_bytes() const {
  return dense_pcd_bytes(normals_, coloured_);
}

std::size_t DensePcd::pixels() const {
  return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
}

std::string_view DensePcd::record(std::size_t pixel) const {
  return records_.substr(pixel * record_bytes(), record_bytes());
}

Eigen::Vector3f DensePcd::in_rig(std::string_view record) const {
  Eigen::Vector3f place;
  std::memcpy(place.data(), record.data(), 3 * sizeof(float));
  if (!base_from_rig_) return place;
  return (base_from_rig_->inverse() * place.cast<double>()).cast<float>();
}

Rgb DensePcd::colour_of(std::string_view record) const {
  std::uint32_t number;
  std::memcpy(&number, record.data() + record.size() - kPcdColourBytes, sizeof number);
  return unpacked(number);
}

std::string DensePcd::to_ply(const DenseFacts& facts) const {
  std::string points;
  std::size_t count = 0;
  DenseFacts all = facts;
  all.base_from_rig = base_from_rig_;
  all.coloured = coloured_;
  for (std::size_t pixel = 0; pixel < pixels(); ++pixel) {
    const std::string_view from = record(pixel);
    all.cameras = std::max(all.cameras, std::size_t{static_cast<std::uint8_t>(from[kCameraAt])} + 1);
    if (!is_measured(from)) continue;
    points.append(from.substr(0, kIntensityAt));
    points += static_cast<char>(intensity_of(from));
    points.append(from.substr(kCameraAt, 1 + (normals_ ? kDenseNormalBytes : 0)));
    if (coloured_) append_colour(colour_of(from), points);
    ++count;
  }
  return dense_ply_header(all, count) + points;
}

PointGrid DensePcd::grid() const {
  PointGrid grid;
  grid.width = width_, grid.height = height_;
  grid.points_mm.resize(pixels()), grid.sigma_mm.resize(pixels());
  grid.intensity.resize(pixels()), grid.camera.resize(pixels());
  for (std::size_t pixel = 0; pixel < pixels(); ++pixel) {
    const std::string_view from = record(pixel);
    grid.points_mm[pixel] = in_rig(from);
    grid.sigma_mm[pixel] = float_at(from, kSigmaAt);
    grid.intensity[pixel] = intensity_of(from);
    grid.camera[pixel] = static_cast<std::uint8_t>(from[kCameraAt]);
    if (coloured_) grid.colours.push_back(colour_of(from));
  }
  return grid;
}

Cloud DensePcd::lattice(int step) const {
  Cloud cloud;
  cloud.lattice_columns = (width_ + step - 1) / step;
  cloud.lattice_rows = (height_ + step - 1) / step;
  for (int y = 0; y < height_; y += step) {
    for (int x = 0; x < width_; x += step) {
      const std::string_view from = record(static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + x);
      const Eigen::Vector3f place = in_rig(from);
      if (!(place.z() > 0)) continue;
      CloudPoint& point = cloud.points.emplace_back();
      point.x = place.x(), point.y = place.y(), point.z = place.z();
      point.column = static_cast<std::uint16_t>(x / step), point.row = static_cast<std::uint16_t>(y / step);
      point.intensity = intensity_of(from);
    }
  }
  return cloud;
}

}  // namespace slsd
