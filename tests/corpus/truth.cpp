// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/corpus/truth.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <sstream>
#include <string>

namespace slsd {

namespace {

constexpr std::string_view kHeader =
    "column,row,left,top,right,bottom,camera_u,camera_v,z_mm,dz_du_mm_px,dz_dv_mm_px,resolvable";
constexpr std::size_t kFields = 12;
constexpr double kMarginPx = 1;  // the box lies around the middles of projector pixels, and blur widens the symbol

using Fields = std::array<std::optional<double>, kFields>;

/// The fields of a line; none where it has another number of them. An empty field has no value.
std::optional<Fields> split(std::string_view line) {
  Fields fields;
  for (std::size_t i = 0; i < kFields; ++i) {
    const std::string_view field = line.substr(0, line.find(','));
    double value = 0;
    if (!field.empty()) {
      const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
      if (error != std::errc() || end != field.data() + field.size()) return std::nullopt;
      fields[i] = value;
    }
    if ((field.size() == line.size()) != (i + 1 == kFields)) return std::nullopt;
    line.remove_prefix(std::min(line.size(), field.size() + 1));
  }
  return fields;
}

std::optional<SurfaceTruth> surface_of(const Fields& f) {
  if (!f[8] || !f[9] || !f[10]) return std::nullopt;
  return SurfaceTruth{{f[6].value(), f[7].value()}, *f[8], {*f[9], *f[10]}};
}

CellTruth cell_of(const Fields& f) {
  return {static_cast<int>(f[0].value()),
          static_cast<int>(f[1].value()),
          {f[2].value(), f[3].value()},
          {f[4].value(), f[5].value()},
          surface_of(f),
          f[11].value() != 0};
}

}  // namespace

double SurfaceTruth::depth_mm(const Eigen::Vector2d& pixel) const {
  return 1 / (1 / z_mm - gradient_mm_px.dot(pixel - middle_px) / (z_mm * z_mm));
}

bool CellTruth::covers(const Eigen::Vector2d& pixel) const {
  return (pixel.array() >= top_left_px.array() - kMarginPx).all() &&
         (pixel.array() <= bottom_right_px.array() + kMarginPx).all();
}

Result<std::vector<CellTruth>> read_truth(std::string_view text, std::string_view name) {
  std::istringstream lines{std::string(text)};
  std::string line;
  if (!std::getline(lines, line) || line != kHeader)
    return fail(ErrorCode::kMalformed, "the first line has to be " + std::string(kHeader), std::string(name) + ":1");
  std::vector<CellTruth> cells;
  for (int number = 2; std::getline(lines, line); ++number) {
    const auto fields = split(line);
    if (!fields) return fail(ErrorCode::kMalformed, "not a cell", std::string(name) + ":" + std::to_string(number));
    cells.push_back(cell_of(*fields));
  }
  return cells;
}

}  // namespace slsd
