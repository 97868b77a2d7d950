// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/cloud/ply.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "core/cloud/coordinate_frame.hpp"
#include "core/cloud/point_record.hpp"

namespace slsd {
namespace {

constexpr std::string_view kBegin = "ply\nformat binary_little_endian 1.0\n";
constexpr std::string_view kUnits = "comment units mm, px\n";

std::string property_lines(bool coloured) {
  std::string lines;
  for (const PointField& field : kPointFields) {
    lines.append("property ").append(field.ply_type).append(" ").append(field.name).append("\n");
  }
  if (coloured) lines += kPlyColourLines;
  return lines + "end_header\n";
}

std::size_t record_bytes(const Cloud& cloud) {
  return kPointBytes + (cloud.coloured ? kPlyColourBytes : 0);
}

// Reads the header's lines one by one, and keeps the first unexpected one as the problem.
class HeaderReader {
 public:
  explicit HeaderReader(std::string_view bytes) : rest_(bytes) {}

  void expect(std::string_view lines) {
    if (rest_.substr(0, lines.size()) != lines) return refuse(lines);
    rest_.remove_prefix(lines.size());
  }
  std::string text(std::string_view key) {
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    const std::string_view line = rest_.substr(0, end);
    if (end == rest_.size() || line.substr(0, key.size()) != key) return refuse(key), std::string();
    rest_.remove_prefix(end + 1);
    return std::string(line.substr(key.size()));
  }
  std::uint64_t number(std::string_view key, std::uint64_t high) {
    const std::string digits = text(key);
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc() || end != digits.data() + digits.size() || value > high) refuse(key);
    return value;
  }
  [[nodiscard]] bool has(std::string_view key) const { return rest_.starts_with(key); }
  float length(std::string_view key) {
    const std::string digits = text(key);
    float value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc() || end != digits.data() + digits.size() || !std::isfinite(value) || value < 0) refuse(key);
    return value;
  }
  // base_from_rig; nothing in the rig's frame.
  std::optional<RigidTransform> frame() {
    auto base_from_rig = base_from_rig_of(rest_.substr(0, rest_.find("element vertex")));
    expect(frame_lines("comment ", base_from_rig ? &*base_from_rig : nullptr));
    return base_from_rig;
  }
  [[nodiscard]] const std::string& problem() const { return problem_; }
  [[nodiscard]] std::string_view rest() const { return rest_; }

 private:
  void refuse(std::string_view expected) {
    if (problem_.empty()) problem_ = expected.substr(0, expected.find('\n'));
  }
  std::string_view rest_;
  std::string problem_;
};

}  // namespace

std::string write_ply(const Cloud& cloud, const RigidTransform* base_from_rig) {
  std::string bytes(kBegin);
  bytes += "comment scan_id " + header_text(cloud.scan_id) + "\n";
  bytes += "comment time " + header_text(cloud.time) + "\n";
  bytes += "comment frame " + std::to_string(cloud.frame) + "\n";
  bytes += kUnits;
  bytes += frame_lines("comment ", base_from_rig);
  if (cloud.sigma_calibration_mm) bytes += "comment sigma_calibration_mm " + sigma_calibration_text(cloud) + "\n";
  bytes += "comment lattice_columns " + std::to_string(cloud.lattice_columns) + "\n";
  bytes += "comment lattice_rows " + std::to_string(cloud.lattice_rows) + "\n";
  bytes += "comment cameras " + std::to_string(cloud.cameras) + "\n";
  bytes += "element vertex " + std::to_string(cloud.points.size()) + "\n";
  bytes += property_lines(cloud.coloured);
  bytes.reserve(bytes.size() + cloud.points.size() * record_bytes(cloud));
  for (const CloudPoint& point : cloud.points) {
    append_point(base_from_rig == nullptr ? point : moved(point, *base_from_rig), bytes);
    if (cloud.coloured) append_colour(point.colour, bytes);
  }
  return bytes;
}

Result<Cloud> read_ply(std::string_view bytes, std::string_view name) {
  constexpr std::uint64_t kMaxLattice = std::numeric_limits<std::uint16_t>::max();
  HeaderReader header(bytes);
  Cloud cloud;
  header.expect(kBegin);
  cloud.scan_id = header.text("comment scan_id ");
  cloud.time = header.text("comment time ");
  cloud.frame = header.number("comment frame ", std::numeric_limits<std::uint64_t>::max());
  header.expect(kUnits);
  const auto base_from_rig = header.frame();
  if (header.has("comment sigma_calibration_mm "))
    cloud.sigma_calibration_mm = header.length("comment sigma_calibration_mm ");
  cloud.lattice_columns = static_cast<int>(header.number("comment lattice_columns ", kMaxLattice));
  cloud.lattice_rows = static_cast<int>(header.number("comment lattice_rows ", kMaxLattice));
  cloud.cameras = static_cast<int>(header.number("comment cameras ", 256));
  const std::uint64_t count = header.number("element vertex ", bytes.size());
  cloud.coloured = header.has(property_lines(true));
  header.expect(property_lines(cloud.coloured));
  const std::string where(name);
  if (!header.problem().empty()) {
    return fail(ErrorCode::kMalformed, "is not a cloud of slsd: expected \"" + header.problem() + "\"", where);
  }
  const std::size_t stride = record_bytes(cloud);
  if (header.rest().size() / stride != count || header.rest().size() % stride != 0) {
    return fail(ErrorCode::kMalformed, "is cut off or too long: expected " + std::to_string(count) + " points", where);
  }
  cloud.points.reserve(count);
  for (std::uint64_t i = 0; i < count; ++i) {
    const char* const record = header.rest().data() + i * stride;
    auto point = read_point(record);
    if (!point) return fail(ErrorCode::kMalformed, "has no valid cell in point " + std::to_string(i), where);
    if (cloud.coloured) std::memcpy(point->colour.data(), record + kPointBytes, kPlyColourBytes);
    cloud.points.push_back(base_from_rig ? moved(*point, base_from_rig->inverse()) : *point);
  }
  return cloud;
}

}  // namespace slsd
