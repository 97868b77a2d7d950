// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "extrinsics.hpp"

#include <optional>
#include <vector>

#include <toml++/toml.h>
#include <Eigen/LU>

namespace slsd::dds {
namespace {

constexpr double kNoRotation = 1e-4;

std::optional<std::vector<double>> numbers(const toml::table& table, const char* key, std::size_t count) {
  const toml::array* values = table[key].as_array();
  if (!values || values->size() != count) return std::nullopt;
  std::vector<double> read;
  for (const toml::node& value : *values) {
    const auto number = value.value<double>();
    if (!number || !std::isfinite(*number)) return std::nullopt;
    read.push_back(*number);
  }
  return read;
}

Result<toml::table> parse(std::string_view text, const std::string& file) {
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    return fail(ErrorCode::kMalformed, std::string(error.description()),
                file + ":" + std::to_string(error.source().begin.line));
  }
}

}  // namespace

Result<std::vector<std::string>> scanners_in(std::string_view text, const std::string& file) {
  auto table = parse(text, file);
  if (!table) return tl::unexpected(table.error());
  std::vector<std::string> names;
  if (const toml::table* scanners = (*table)["scanner"].as_table()) {
    for (const auto& [name, entry] : *scanners) names.emplace_back(name.str());
  }
  return names;
}

Result<Extrinsics> read_extrinsics(std::string_view text, const std::string& scanner, const std::string& file) {
  auto parsed = parse(text, file);
  if (!parsed) return tl::unexpected(parsed.error());
  toml::table& table = *parsed;
  const toml::table* entry = table["scanner"][scanner].as_table();
  if (!entry) {
    return fail(ErrorCode::kNotFound,
                "extrinsics_missing: the file has no [scanner." + scanner + "]: measure it with slsd --extrinsics",
                file);
  }
  const auto rotation = numbers(*entry, "rotation", 9), translation = numbers(*entry, "translation_mm", 3);
  const auto parent = table["parent"].value<std::string>();
  if (!rotation || !translation || !parent || parent->empty()) {
    return fail(ErrorCode::kMalformed,
                "scanner." + scanner + " needs parent, rotation (9 numbers) and translation_mm (3 numbers)", file);
  }
  Extrinsics extrinsics;
  extrinsics.parent = *parent;
  extrinsics.parent_from_scanner.rotation =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rotation->data());
  extrinsics.parent_from_scanner.translation = Eigen::Map<const Eigen::Vector3d>(translation->data());
  extrinsics.calibration_date = (*entry)["calibration_date"].value_or(std::string());
  const Eigen::Matrix3d& turn = extrinsics.parent_from_scanner.rotation;
  if ((turn * turn.transpose() - Eigen::Matrix3d::Identity()).norm() > kNoRotation || turn.determinant() < 0) {
    return fail(ErrorCode::kMalformed, "scanner." + scanner + ".rotation is not a rotation matrix", file);
  }
  return extrinsics;
}

}  // namespace slsd::dds
