// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/commands/device_list.hpp"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <sstream>
#include <utility>

#include "core/image_size.hpp"
#include "core/printable.hpp"
#include "drivers/projector/x11/choose_output.hpp"
#include "programs/commands/commands.hpp"

namespace slsd {
namespace {

using nlohmann::json;

constexpr const char* kIndent = "\n    ";

ListingPlaces places_of(const Configuration& configuration) {
  ListingPlaces places;
  for (const CameraOptions& camera : configuration.cameras) {
    std::visit(Overloaded{[](const FileCameraOptions&) {},
                          [&](const V4l2CameraOptions& v4l2) { places.configured_nodes.push_back(v4l2.device_path()); },
                          [&](const AravisCameraOptions& aravis) { places.configured_ids.push_back(aravis.id); }},
               camera.of_driver);
  }
  return places;
}

std::string formats_text(const ListedCamera& camera) {
  std::string text;
  for (const ListedFormat& format : camera.formats) {
    text += (text.empty() ? "" : "; ") + printable(format.name);
    for (const auto& [width, height] : format.sizes_px) (text += " ") += size_text(width, height);
  }
  return text;
}

std::string place_text(const ListedCamera& camera) {
  std::string text = camera.node.empty() ? camera.address + " through " + camera.interface : camera.node;
  if (!camera.kernel_driver.empty()) (text += " by ") += printable(camera.kernel_driver);
  if (camera.link_mbps) text += ", link of " + std::to_string(*camera.link_mbps) + " Mbit/s";
  return text;
}

std::string maker_text(const ListedCamera& camera) {
  std::string text = camera.standard;
  for (const std::string& part : {camera.vendor, camera.model})
    if (!part.empty()) (text += ", ") += printable(part);
  if (!camera.serial.empty()) (text += ", serial ") += printable(camera.serial);
  return text;
}

std::string camera_text(const ListedCamera& camera, const CameraOptions* configured) {
  std::ostringstream text;
  text << "camera " << printable(camera.name) << kIndent << maker_text(camera) << kIndent << "at "
       << place_text(camera);
  if (!camera.formats.empty()) text << kIndent << "formats: " << formats_text(camera);
  if (!camera.user.empty()) text << kIndent << "controlled by " << printable(camera.user);
  if (!camera.problem.empty()) text << kIndent << "problem: " << printable(camera.problem, 1000);
  if (configured != nullptr) text << kIndent << "configured as \"" << configured->name() << "\"";
  text << "\n";
  return text.str();
}

/// The message about a configured camera that is not visible.
std::string unseen_text(const CameraOptions& camera) {
  std::ostringstream text;
  text << "configured camera \"" << camera.name() << "\", driver " << camera.driver() << ": ";
  const auto* const file = std::get_if<FileCameraOptions>(&camera.of_driver);
  text << (file != nullptr ? "replays " + file->path.string() : "is not found") << "\n";
  return text.str();
}

/// Describes the projector. Without such a table the default projector applies, which is not visible.
std::string projector_text(const Configuration& configuration) {
  if (!configuration.given.contains("projector")) return "no projector is configured: set its monitor in [projector]\n";
  const ProjectorOptions& projector = configuration.projector;
  return "configured projector: driver " + std::string(to_string(projector.driver)) + ", " +
         size_text(projector.width_px, projector.height_px) + " px\n";
}

json format_json(const ListedFormat& format) {
  json sizes = json::array();
  for (const auto& [width, height] : format.sizes_px) sizes.push_back({{"width_px", width}, {"height_px", height}});
  return {{"name", format.name}, {"sizes", sizes}};
}

json camera_json(const ListedCamera& camera, const CameraOptions* configured) {
  json result{{"name", camera.name}, {"standard", camera.standard}, {"driver", camera.driver}};
  const std::pair<const char*, const std::string&> texts[]{{"vendor", camera.vendor},
                                                           {"model", camera.model},
                                                           {"serial", camera.serial},
                                                           {"node", camera.node},
                                                           {"kernel_driver", camera.kernel_driver},
                                                           {"address", camera.address},
                                                           {"interface", camera.interface},
                                                           {"controlled_by", camera.user},
                                                           {"problem", camera.problem}};
  for (const auto& [name, text] : texts)
    if (!text.empty()) result[name] = text;
  if (camera.link_mbps) result["link_mbps"] = *camera.link_mbps;
  result["formats"] = json::array();
  for (const ListedFormat& format : camera.formats) result["formats"].push_back(format_json(format));
  if (configured != nullptr) result["configured_as"] = configured->name();
  return result;
}

}  // namespace

bool names(const CameraOptions& options, const ListedCamera& camera) {
  if (options.driver() != camera.driver) return false;
  return std::visit(Overloaded{[](const FileCameraOptions&) { return false; },
                               [&](const V4l2CameraOptions& v4l2) {
                                 std::error_code ignored;
                                 return std::filesystem::equivalent(v4l2.device_path(), camera.node, ignored);
                               },
                               [&](const AravisCameraOptions& aravis) {
                                 return aravis.id == camera.name || aravis.id == camera.serial ||
                                        aravis.id == camera.address;
                               }},
                    options.of_driver);
}

CameraList CameraList::look(const Configuration& configuration) {
  return {configuration, list_cameras(places_of(configuration))};
}

CameraList::CameraList(const Configuration& configuration, CameraListing listing)
    : configuration_(&configuration), listing_(std::move(listing)) {}

const ListedCamera* CameraList::find(const CameraOptions& configured) const {
  const auto found =
      std::ranges::find_if(listing_.cameras, [&](const ListedCamera& seen) { return names(configured, seen); });
  return found == listing_.cameras.end() ? nullptr : &*found;
}

const CameraOptions* CameraList::find(const ListedCamera& seen) const {
  const auto found =
      std::ranges::find_if(configuration_->cameras, [&](const CameraOptions& one) { return names(one, seen); });
  return found == configuration_->cameras.end() ? nullptr : &*found;
}

std::string CameraList::text() const {
  std::string text;
  for (const ListedCamera& camera : listing_.cameras) text += camera_text(camera, find(camera));
  if (listing_.cameras.empty()) {
    text += "no camera found; searched:";
    for (const std::string& place : listing_.looked_at) text += kIndent + place;
    text += "\n";
  }
  for (const CameraOptions& camera : configuration_->cameras)
    if (find(camera) == nullptr) text += unseen_text(camera);
  return text;
}

json CameraList::json() const {
  nlohmann::json result{{"cameras", json::array()}, {"configured", json::array()}, {"looked_at", listing_.looked_at}};
  for (const ListedCamera& camera : listing_.cameras) result["cameras"].push_back(camera_json(camera, find(camera)));
  for (const CameraOptions& camera : configuration_->cameras)
    result["configured"].push_back(
        {{"name", camera.name()}, {"driver", camera.driver()}, {"seen", camera.replays() || find(camera) != nullptr}});
  return result;
}

std::string CameraList::similar_to(const CameraOptions& absent) const {
  std::string similar;
  for (const ListedCamera& camera : listing_.cameras)
    if (camera.driver == absent.driver()) similar += (similar.empty() ? "" : ", ") + printable(camera.name);
  return similar.empty() ? "no other camera of this driver is found; slsd --list shows where it searches"
                         : "found with this driver: " + similar;
}

std::string MonitorList::text() const {
  if (!outputs_) return "no monitor: " + outputs_.error().message + "\n";
  if (outputs_->empty()) return "no monitor is plugged in and on\n";
  std::string text;
  for (const RandrOutput& output : *outputs_) text += "monitor " + describe_output(output) + "\n";
  return text;
}

nlohmann::json MonitorList::json() const {
  nlohmann::json monitors = nlohmann::json::array();
  if (!outputs_) return monitors;
  for (const RandrOutput& output : *outputs_) {
    monitors.push_back({{"name", output.name},
                        {"model", output.model},
                        {"serial", output.serial},
                        {"x_px", output.area.x_px},
                        {"y_px", output.area.y_px},
                        {"width_px", output.area.width_px},
                        {"height_px", output.area.height_px},
                        {"refresh_hz", output.refresh_hz},
                        {"primary", output.primary}});
  }
  return monitors;
}

Result<> list_devices(const std::optional<std::filesystem::path>& configuration_file, bool as_json) {
  const auto configuration = load_configuration_or_defaults(configuration_file);
  if (!configuration) return tl::unexpected(configuration.error());
  const CameraList cameras = CameraList::look(*configuration);
  const MonitorList monitors = MonitorList::look();
  if (as_json) {
    nlohmann::json devices = cameras.json();
    devices["monitors"] = monitors.json();
    std::cout << devices.dump(2) << "\n";
    return {};
  }
  std::cout << projector_text(*configuration) << monitors.text() << cameras.text();
  return {};
}

}  // namespace slsd
