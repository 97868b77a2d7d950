// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/cloud/pcd.hpp"

#include <limits>
#include <vector>

#include "core/cloud/coordinate_frame.hpp"
#include "core/cloud/point_record.hpp"

namespace slsd {
namespace {

template <class Value>
std::string line_of_fields(std::string_view key, bool coloured, Value value) {
  std::string line(key);
  for (const PointField& field : kPointFields) line.append(" ").append(value(field));
  if (coloured) line.append(" ").append(value(kPcdColour));
  return line + "\n";
}

std::string header(const Cloud& cloud, const RigidTransform* base_from_rig) {
  const std::string width = std::to_string(cloud.lattice_columns);
  const std::string height = std::to_string(cloud.lattice_rows * cloud.cameras);
  const std::string points = std::to_string(cloud.lattice_columns * cloud.lattice_rows * cloud.cameras);
  return "# .PCD v0.7 - Point Cloud Data file format\n# scan_id " + header_text(cloud.scan_id) + "\n# time " +
         header_text(cloud.time) + "\n# frame " + std::to_string(cloud.frame) +
         (cloud.sigma_calibration_mm ? "\n# sigma_calibration_mm " + sigma_calibration_text(cloud) : "") +
         "\n# units mm, px\n" + frame_lines("# ", base_from_rig) + "VERSION 0.7\n" +
         line_of_fields("FIELDS", cloud.coloured, [](const PointField& field) { return std::string(field.name); }) +
         line_of_fields("SIZE", cloud.coloured,
                        [](const PointField& field) { return std::to_string(field.pcd_bytes); }) +
         line_of_fields("TYPE", cloud.coloured,
                        [](const PointField& field) { return std::string(1, field.pcd_type); }) +
         line_of_fields("COUNT", cloud.coloured, [](const PointField&) { return std::string("1"); }) + "WIDTH " +
         width + "\nHEIGHT " + height + "\n" + viewpoint_line(base_from_rig) + "POINTS " + points + "\nDATA binary\n";
}

CloudPoint no_point(int camera, int row, int column) {
  CloudPoint point;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  point.x = point.y = point.z = point.sigma_mm = nan;
  point.camera_u = point.camera_v = point.projector_u = point.projector_v = nan;
  point.camera = static_cast<std::uint8_t>(camera);
  point.row = static_cast<std::uint16_t>(row);
  point.column = static_cast<std::uint16_t>(column);
  return point;
}

// The cameras' lattices one below the other, each row by row.
std::vector<CloudPoint> organised(const Cloud& cloud) {
  std::vector<CloudPoint> cells;
  for (int camera = 0; camera < cloud.cameras; ++camera) {
    for (int row = 0; row < cloud.lattice_rows; ++row) {
      for (int column = 0; column < cloud.lattice_columns; ++column) cells.push_back(no_point(camera, row, column));
    }
  }
  for (const CloudPoint& point : cloud.points) {
    if (point.camera >= cloud.cameras || point.row >= cloud.lattice_rows || point.column >= cloud.lattice_columns) {
      continue;
    }
    const std::size_t row = static_cast<std::size_t>(point.camera) * cloud.lattice_rows + point.row;
    cells[row * cloud.lattice_columns + point.column] = point;
  }
  return cells;
}

}  // namespace

std::string write_pcd(const Cloud& cloud, const RigidTransform* base_from_rig) {
  std::string bytes = header(cloud, base_from_rig);
  const std::vector<CloudPoint> cells = organised(cloud);
  bytes.reserve(bytes.size() + cells.size() * (kPcdPointBytes + (cloud.coloured ? kPcdColourBytes : 0)));
  for (const CloudPoint& cell : cells) {
    append_pcd_point(base_from_rig == nullptr ? cell : moved(cell, *base_from_rig), bytes);
    if (cloud.coloured) append_pcd_colour(cell.colour, bytes);
  }
  return bytes;
}

}  // namespace slsd
