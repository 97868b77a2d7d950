// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <utility>

namespace slsd {

/// Picture that a projector shows.
enum class Picture {
  kPattern,
  kWhite,
  kBlack,
  kFocus,  ///< a chart for focusing
  kGrid,   ///< each camera's view
  kImage,  ///< a client's own picture
  kIdle,   ///< the configured picture while nobody scans: one of the first three
  kHeld,   ///< a client's choice until the next scan: any of the above
};

inline constexpr std::array kPictureNames{
    std::pair<std::string_view, Picture>("pattern", Picture::kPattern),
    std::pair<std::string_view, Picture>("white", Picture::kWhite),
    std::pair<std::string_view, Picture>("black", Picture::kBlack),
    std::pair<std::string_view, Picture>("focus", Picture::kFocus),
    std::pair<std::string_view, Picture>("grid", Picture::kGrid),
    std::pair<std::string_view, Picture>("image", Picture::kImage),
    std::pair<std::string_view, Picture>("idle", Picture::kIdle),
    std::pair<std::string_view, Picture>("held", Picture::kHeld),
};

[[nodiscard]] constexpr std::string_view to_string(Picture picture) {
  return std::ranges::find(kPictureNames, picture, &std::pair<std::string_view, Picture>::second)->first;
}

[[nodiscard]] constexpr std::optional<Picture> picture_named(std::string_view name) {
  const auto* found = std::ranges::find(kPictureNames, name, &std::pair<std::string_view, Picture>::first);
  return found == kPictureNames.end() ? std::nullopt : std::optional(found->second);
}

/// Name of a frame that was exposed under the picture: under black, only the light of the room remains.
[[nodiscard]] constexpr std::string_view light_name(Picture picture) {
  return picture == Picture::kBlack ? "dark" : to_string(picture);
}

}  // namespace slsd
