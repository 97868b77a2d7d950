// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/cloud/coordinate_frame.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include <Eigen/Geometry>

namespace slsd {
namespace {

constexpr std::string_view kBaseFromRig = "base_from_rig ";
constexpr int kFrameDigits = 12;

void append_number(double value, std::string& text) {
  std::array<char, 32> digits;
  const auto end =
      std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::general, kFrameDigits);
  text.append(" ").append(digits.data(), end.ptr);
}

}  // namespace

std::string frame_lines(std::string_view mark, const RigidTransform* base_from_rig) {
  std::string lines(mark);
  if (base_from_rig == nullptr)
    return lines.append("coordinate_frame rig: the first camera's, x right, y down, z forward\n");
  lines.append("coordinate_frame robot_base: the robot's\n").append(mark).append(kBaseFromRig);
  lines.pop_back();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) append_number(base_from_rig->rotation(row, column), lines);
    append_number(base_from_rig->translation[row], lines);
  }
  return lines + "\n";
}

std::string viewpoint_line(const RigidTransform* base_from_rig) {
  if (base_from_rig == nullptr) return "VIEWPOINT 0 0 0 1 0 0 0\n";
  const Eigen::Quaterniond turn(base_from_rig->rotation);
  const Eigen::Vector3d& place = base_from_rig->translation;
  std::string line = "VIEWPOINT";
  for (const double number : {place.x(), place.y(), place.z(), turn.w(), turn.x(), turn.y(), turn.z()})
    append_number(number, line);
  return line + "\n";
}

std::optional<RigidTransform> base_from_rig_of(std::string_view header) {
  const std::size_t begin = header.find(kBaseFromRig);
  if (begin == std::string_view::npos) return std::nullopt;
  std::string_view rest = header.substr(begin + kBaseFromRig.size());
  rest = rest.substr(0, rest.find('\n'));
  std::array<double, 12> numbers{};
  for (double& number : numbers) {
    rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size()));
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
    if (error != std::errc() || !std::isfinite(number)) return std::nullopt;
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  }
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> rows(numbers.data());
  return RigidTransform{rows.leftCols<3>(), rows.col(3)};
}

CloudPoint moved(CloudPoint point, const RigidTransform& there_from_here) {
  const Eigen::Vector3d there = there_from_here * Eigen::Vector3d(point.x, point.y, point.z);
  point.x = static_cast<float>(there.x());
  point.y = static_cast<float>(there.y());
  point.z = static_cast<float>(there.z());
  return point;
}

}  // namespace slsd
