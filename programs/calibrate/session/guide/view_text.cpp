// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/session/guide/view_text.hpp"

#include <fmt/format.h>

namespace slsd {

std::string view_text(const BoardSightings& sightings, const std::vector<std::string>& cameras) {
  std::string text;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (i > 0) text += "; ";
    text += cameras[i] + ": ";
    text += sightings[i] ? fmt::format("{} corners, edges {:.1f} px, clipped {:.0f} %", sightings[i]->points.size(),
                                       sightings[i]->edge_px, 100 * sightings[i]->clipped_share)
                         : sightings[i].error().message;
  }
  return text;
}

std::string unseen_text(const BoardSightings& sightings, const std::vector<std::string>& cameras) {
  std::string text;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (!sightings[i]) text += fmt::format("\n  camera {}: {}", cameras[i], to_string(sightings[i].error()));
  }
  return text;
}

}  // namespace slsd
