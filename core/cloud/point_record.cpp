// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/cloud/point_record.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

namespace slsd {
namespace {

static_assert(std::endian::native == std::endian::little, "the records are copied as they lie in memory");

constexpr std::size_t field_bytes() {
  std::size_t sum = 0;
  for (const PointField& field : kPointFields) sum += static_cast<std::size_t>(field.bytes);
  return sum;
}
static_assert(field_bytes() == kPointBytes);

// Calls visit with each member, in the order of kPointFields.
template <class Point, class Visit>
void for_each_field(Point& point, Visit visit) {
  visit(point.x), visit(point.y), visit(point.z);
  visit(point.intensity);
  visit(point.camera_u), visit(point.camera_v), visit(point.projector_u), visit(point.projector_v);
  visit(point.camera), visit(point.symbol);
  visit(point.sigma_mm);
  visit(point.column), visit(point.row);
}

}  // namespace

void append_point(const CloudPoint& point, std::string& bytes) {
  for_each_field(point,
                 [&bytes](const auto& field) { bytes.append(reinterpret_cast<const char*>(&field), sizeof field); });
}

CloudPoint read_point(const char* bytes) {
  CloudPoint point;
  for_each_field(point, [&bytes](auto& field) {
    std::memcpy(&field, bytes, sizeof field);
    bytes += sizeof field;
  });
  return point;
}

std::string header_text(std::string_view text) {
  std::string line(text);
  std::replace_if(
      line.begin(), line.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
  return line;
}

}  // namespace slsd
