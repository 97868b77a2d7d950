// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/captures/pose_collection.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "core/calibrate/judge/coverage.hpp"
#include "core/geometry/robust.hpp"
#include "programs/calibrate/captures/captured_pictures.hpp"

namespace slsd {
namespace {

constexpr double kTiltedDeg = 15;
constexpr double kCoverageEnough = 0.5;  // share of an image; the verdict calls this good
constexpr double kDistanceSpread = 1.15;
constexpr std::size_t kUsualMin = 3;

/// The side of the camera's picture that the board faces.
std::size_t side_of(const BoardPlace& place) {
  const Eigen::Vector3d face = -place.normal;
  if (std::abs(face.x()) > std::abs(face.y())) return face.x() < 0 ? 0 : 1;
  return face.y() < 0 ? 2 : 3;
}

}  // namespace

PoseCollection::PoseCollection(const Board& board, const Observations& so_far, PoseSubject subject)
    : board_(board), subject_(subject), observations_{so_far.cameras, so_far.projector, {}} {
  for (const PoseObservation& pose : so_far.poses) {
    if (pose.subject == subject) add(pose);
  }
}

Result<> PoseCollection::set_sizes(const std::vector<GreyImage>& pictures) {
  for (std::size_t i = 0; i < std::min(pictures.size(), observations_.cameras.size()); ++i) {
    NamedCamera& camera = observations_.cameras[i];
    const ImageSize now = size_of(pictures[i]);
    if (camera.size == ImageSize{}) camera.size = now;
    if (camera.size == now) continue;
    return fail(ErrorCode::kMismatch,
                fmt::format("takes pictures of {}x{} pixels, but the recorded poses have {}x{}: restore its mode, or "
                            "start again in another folder",
                            now.width_px, now.height_px, camera.size.width_px, camera.size.height_px),
                "camera " + camera.name);
  }
  return {};
}

void PoseCollection::add(PoseObservation pose) {
  Places& places = places_.emplace_back();
  for (const PoseView& seen : pose.views) {
    const auto place = place_of(ties_of(seen), board_, observations_.cameras[seen.camera].size);
    if (place) places.insert_or_assign(seen.camera, *place);
  }
  observations_.poses.push_back(std::move(pose));
}

std::string PoseCollection::same_as(const BoardSightings& sightings) const {
  Places now;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (!sightings[i]) continue;
    const auto place = place_of(ties_of(*sightings[i], board_), board_, observations_.cameras[i].size);
    if (place) now.insert_or_assign(i, *place);
  }
  for (std::size_t pose = 0; pose < places_.size(); ++pose) {
    const Places& then = places_[pose];
    const bool same = std::ranges::all_of(now, [&](const auto& seen) {
      const auto earlier = then.find(seen.first);
      return earlier != then.end() && are_alike(earlier->second, seen.second);
    });
    if (same && !now.empty()) return observations_.poses[pose].name;
  }
  return {};
}

double PoseCollection::usual_blur_px(std::size_t camera) const {
  std::vector<double> blurs;
  for (const PoseObservation& pose : observations_.poses) {
    for (const PoseView& seen : pose.views) {
      if (seen.camera == camera) blurs.push_back(seen.blur_px);
    }
  }
  return blurs.size() < kUsualMin ? 0 : median_in_place(blurs);
}

std::string PoseCollection::most_helpful() const {
  if (subject_ == PoseSubject::kPlane) return next_place_of_plane();
  if (places_.empty()) return "hold the board where the projector lights it, facing the camera";
  for (const std::string& missing :
       {missing_tilt(), missing_place(kCoverageEnough), missing_distance(), missing_place(1)}) {
    if (!missing.empty()) return missing;
  }
  return "any pose that differs from the others";
}

/// The advice to tilt the board to the rarest side; empty if half of the poses are tilted.
std::string PoseCollection::missing_tilt() const {
  static constexpr std::array kSides{"left", "right", "upper edge", "lower edge"};
  std::array<std::size_t, kSides.size()> counts{};
  std::size_t tilted = 0;
  for (const Places& places : places_) {
    if (places.empty() || places.begin()->second.tilt_deg() < kTiltedDeg) continue;
    ++counts[side_of(places.begin()->second)];
    ++tilted;
  }
  if (2 * tilted >= places_.size()) return {};
  const auto rarest = static_cast<std::size_t>(std::ranges::min_element(counts) - counts.begin());
  return fmt::format("tilt the board by 20 to 40 degrees, so that it faces the {} of the camera's picture",
                     kSides[rarest]);
}

/// The emptiest place of the device with the least coverage, if that is not enough.
std::string PoseCollection::missing_place(double enough) const {
  Coverage least = projector_coverage(observations_);
  std::string device = "the projector's light";
  for (std::size_t i = 0; i < observations_.cameras.size(); ++i) {
    const Coverage coverage = camera_coverage(observations_, i);
    if (coverage.share() >= least.share()) continue;
    least = coverage;
    device = fmt::format("the picture of camera {}", observations_.cameras[i].name);
  }
  if (least.share() >= enough || least.emptiest().empty()) return {};
  return fmt::format("show the board in {} of {}", least.emptiest(), device);
}

std::string PoseCollection::missing_distance() const {
  std::vector<double> distances;
  for (const Places& places : places_) {
    if (!places.empty()) distances.push_back(places.begin()->second.distance_mm);
  }
  if (distances.empty()) return {};
  const auto [nearest, farthest] = std::ranges::minmax(distances);
  return farthest < kDistanceSpread * nearest ? "hold the board nearer, or farther away" : "";
}

std::string PoseCollection::next_place_of_plane() const {
  static constexpr std::array kPlaces{"at your nearest scanning distance", "in the middle of your scanning range",
                                      "at your farthest scanning distance"};
  return fmt::format("hold the reference plane {}, facing the camera", kPlaces[places_.size() % kPlaces.size()]);
}

}  // namespace slsd
