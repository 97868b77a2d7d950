// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/cloud/point_record.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <limits>

#include "core/colour.hpp"

namespace slsd {
namespace {

static_assert(std::endian::native == std::endian::little, "the records are copied as they lie in memory");

constexpr std::size_t field_bytes(int PointField::*bytes) {
  std::size_t sum = 0;
  for (const PointField& field : kPointFields) sum += static_cast<std::size_t>(field.*bytes);
  return sum;
}
static_assert(field_bytes(&PointField::ply_bytes) == kPointBytes);
static_assert(field_bytes(&PointField::pcd_bytes) == kPcdPointBytes);

// Column and row are int in a file: some readers do not know PLY's ushort.
struct Cell {
  std::int32_t column;
  std::int32_t row;

  [[nodiscard]] bool valid() const { return fits(column) && fits(row); }
  static bool fits(std::int32_t value) { return value >= 0 && value <= std::numeric_limits<std::uint16_t>::max(); }
};

// Calls visit with each field, in the order of kPointFields.
template <class Point, class Intensity, class Cell, class Visit>
void for_each_field(Point& point, Intensity& intensity, Cell& cell, Visit visit) {
  visit(point.x), visit(point.y), visit(point.z);
  visit(intensity);
  visit(point.camera_u), visit(point.camera_v), visit(point.projector_u), visit(point.projector_v);
  visit(point.camera), visit(point.symbol);
  visit(point.sigma_mm);
  visit(cell.column), visit(cell.row);
}

template <class Intensity>
void append(const CloudPoint& point, Intensity intensity, std::string& bytes) {
  const Cell cell{point.column, point.row};
  for_each_field(point, intensity, cell,
                 [&bytes](const auto& field) { bytes.append(reinterpret_cast<const char*>(&field), sizeof field); });
}

}  // namespace

void append_point(const CloudPoint& point, std::string& bytes) {
  append(point, point.intensity, bytes);
}

void append_pcd_point(const CloudPoint& point, std::string& bytes) {
  append(point, static_cast<float>(point.intensity), bytes);
}

void append_colour(const Rgb& colour, std::string& bytes) {
  bytes.append(reinterpret_cast<const char*>(colour.data()), colour.size());
}

void append_pcd_colour(const Rgb& colour, std::string& bytes) {
  const std::uint32_t number = packed(colour);
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

std::optional<CloudPoint> read_point(const char* bytes) {
  CloudPoint point;
  Cell cell{};
  for_each_field(point, point.intensity, cell, [&bytes](auto& field) {
    std::memcpy(&field, bytes, sizeof field);
    bytes += sizeof field;
  });
  if (!cell.valid()) return std::nullopt;
  point.column = static_cast<std::uint16_t>(cell.column);
  point.row = static_cast<std::uint16_t>(cell.row);
  return point;
}

std::string sigma_calibration_text(const Cloud& cloud) {
  if (!cloud.sigma_calibration_mm) return {};
  std::array<char, 32> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), *cloud.sigma_calibration_mm);
  return {digits.data(), end};
}

std::string header_text(std::string_view text) {
  std::string line(text);
  std::replace_if(
      line.begin(), line.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
  return line;
}

}  // namespace slsd
