// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/listing/list_cameras.hpp"

#include "drivers/camera/aravis/gige/configure_network.hpp"
#include "drivers/camera/aravis/list_vision_cameras.hpp"
#include "drivers/camera/v4l2/list_v4l2_cameras.hpp"

namespace slsd {
namespace {

std::vector<std::string> looked_at(const ListingPlaces& places) {
  std::vector<std::string> where{"V4L2: " + (places.devices / "video*").string()};
  std::string networks;
  for (const HostInterface& interface : list_host_interfaces())
    networks += (networks.empty() ? "" : ", ") + interface.text();
  where.push_back("GigE Vision: by broadcast on " + (networks.empty() ? "no network" : networks));
  where.push_back("USB3 Vision: " + (places.sysfs / "bus/usb/devices").string());
  for (const auto& node : places.configured_nodes) where.push_back("V4L2: " + node.string());
  for (const auto& id : places.configured_ids) where.push_back("GigE Vision, USB3 Vision: " + id);
  return where;
}

}  // namespace

CameraListing list_cameras(const ListingPlaces& places) {
  CameraListing listing{list_v4l2_cameras(places.devices, places.sysfs, places.configured_nodes), looked_at(places)};
  for (ListedCamera& camera : list_vision_cameras(places.sysfs, places.configured_ids))
    listing.cameras.push_back(std::move(camera));
  return listing;
}

}  // namespace slsd
