// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/cloud/read_dense_ply.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>

#include <fmt/format.h>

namespace slsd {
namespace {

/// Offsets of a record's fields.
struct CloudLayout {
  static constexpr std::array<std::string_view, 9> kNames{"x",      "y",   "z",     "sigma_mm", "intensity",
                                                          "camera", "red", "green", "blue"};
  static constexpr std::size_t kNeeded = 6, kRed = 6;
  std::array<std::optional<std::size_t>, kNames.size()> offsets;
  std::size_t record_bytes = 0, points = 0;
  bool symbols = false;
  bool rig = true;  ///< its points are in the rig's frame

  [[nodiscard]] bool has(std::size_t from, std::size_t to) const {
    return std::all_of(offsets.begin() + from, offsets.begin() + to,
                       [](const auto& offset) { return offset.has_value(); });
  }
};

/// The text before a mark, which both leave `text`; nothing if there is no mark.
std::optional<std::string_view> take_until(std::string_view& text, char mark) {
  const std::size_t end = text.find(mark);
  if (end == std::string_view::npos) return std::nullopt;
  const std::string_view taken = text.substr(0, end);
  text.remove_prefix(end + 1);
  return taken;
}

bool add_property(CloudLayout& layout, std::string_view type_and_name) {
  const auto type = take_until(type_and_name, ' ');
  if (!type || (*type != "float" && *type != "uchar")) return false;
  const std::size_t field =
      static_cast<std::size_t>(std::ranges::find(CloudLayout::kNames, type_and_name) - CloudLayout::kNames.begin());
  constexpr std::size_t kFloats = 4;
  if (field < CloudLayout::kNames.size()) {
    if ((field < kFloats) != (*type == "float")) return false;
    layout.offsets[field] = layout.record_bytes;
  }
  layout.symbols = layout.symbols || type_and_name == "symbol";
  layout.record_bytes += *type == "float" ? 4 : 1;
  return true;
}

bool read_number(std::string_view text, std::size_t& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

/// Takes the header from the bytes.
std::optional<CloudLayout> take_header(std::string_view& bytes) {
  constexpr std::string_view kVertices = "element vertex ", kProperty = "property ",
                             kFrame = "comment coordinate_frame ";
  if (take_until(bytes, '\n') != "ply" || take_until(bytes, '\n') != "format binary_little_endian 1.0")
    return std::nullopt;
  CloudLayout layout;
  while (const auto line = take_until(bytes, '\n')) {
    if (*line == "end_header") return layout;
    if (line->starts_with(kVertices) && !read_number(line->substr(kVertices.size()), layout.points))
      return std::nullopt;
    if (line->starts_with(kFrame)) layout.rig = line->substr(kFrame.size()).starts_with("rig");
    // Properties of symbols may have other types.
    if (line->starts_with(kProperty) && !add_property(layout, line->substr(kProperty.size())) && !layout.symbols)
      return std::nullopt;
  }
  return std::nullopt;
}

template <class Number>
Number number_at(const char* record, std::size_t offset) {
  Number number;
  std::memcpy(&number, record + offset, sizeof number);
  return number;
}

}  // namespace

Result<std::vector<DensePoint>> read_dense_ply(std::string_view bytes) {
  const auto layout = take_header(bytes);
  if (!layout) return fail(ErrorCode::kMalformed, "is not a cloud that slsd wrote as PLY");
  if (layout->symbols)
    return fail(
        ErrorCode::kUnsupported,
        "has a point for each symbol; one for each pixel is needed: scan or record again with --density pixels");
  if (!layout->rig)
    return fail(ErrorCode::kUnsupported,
                "has its points in the robot's base; they are needed in the scanner's frame: scan with "
                "--coordinate-frame rig");
  if (!layout->has(0, CloudLayout::kNeeded))
    return fail(ErrorCode::kMalformed, "is not a dense cloud: it lacks sigma_mm, intensity or camera");
  if (bytes.size() / layout->record_bytes < layout->points)
    return fail(ErrorCode::kMalformed,
                fmt::format("is cut: it has {} of {} points", bytes.size() / layout->record_bytes, layout->points));
  const bool coloured = layout->has(CloudLayout::kRed, CloudLayout::kNames.size());
  std::vector<DensePoint> points;
  points.reserve(layout->points);
  for (std::size_t i = 0; i < layout->points; ++i) {
    const char* const record = bytes.data() + i * layout->record_bytes;
    DensePoint point;
    for (int axis = 0; axis < 3; ++axis) point.place_mm[axis] = number_at<float>(record, *layout->offsets[axis]);
    point.sigma_mm = number_at<float>(record, *layout->offsets[3]);
    point.intensity = number_at<std::uint8_t>(record, *layout->offsets[4]);
    point.camera = number_at<std::uint8_t>(record, *layout->offsets[5]);
    point.coloured = coloured;
    for (std::size_t i = 0; coloured && i < point.colour.size(); ++i)
      point.colour[i] = number_at<std::uint8_t>(record, *layout->offsets[CloudLayout::kRed + i]);
    if (!point.place_mm.allFinite() || !(point.sigma_mm > 0) || !std::isfinite(point.sigma_mm))
      return fail(ErrorCode::kMalformed, fmt::format("point {} has no place or no sigma", i));
    points.push_back(point);
  }
  return points;
}

}  // namespace slsd
