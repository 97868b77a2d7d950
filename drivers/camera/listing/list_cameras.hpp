// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "drivers/camera/listing/listed_camera.hpp"

namespace slsd {

/// The places that list_cameras() searches.
struct ListingPlaces {
  std::filesystem::path devices = "/dev";
  std::filesystem::path sysfs = "/sys";
  std::vector<std::filesystem::path> configured_nodes = {};  ///< configured device nodes, wherever they are
  std::vector<std::string> configured_ids = {};              ///< GigE Vision and USB3 Vision
};

struct CameraListing {
  std::vector<ListedCamera> cameras;
  std::vector<std::string> looked_at;  ///< the places searched, in words
};

/// Lists the cameras that this host can see. Takes a second or two.
/// @thread reentrant
[[nodiscard]] CameraListing list_cameras(const ListingPlaces& places);

}  // namespace slsd
