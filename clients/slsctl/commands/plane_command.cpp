// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cmath>
#include <iostream>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "clients/slsctl/commands/client_commands.hpp"
#include "clients/slsctl/output.hpp"
#include "clients/slsctl/report.hpp"
#include "core/cloud/ply.hpp"
#include "core/geometry/plane_fit.hpp"

namespace slsd {
namespace {

using nlohmann::json;

constexpr double kMarginInScatters = 5;
constexpr double kDegrees = 180 / M_PI;

/// The plane before which everything is kept, in the frame of [cloud] box.
struct SeenPlane {
  PlaneFit fit;                ///< from the scanner as origin
  Eigen::Vector3d to_scanner;  ///< unit normal
  double offset_mm;            ///< of the kept side's border along that normal
  double margin_mm;
  std::size_t points;  ///< all of the scan
};

// The scanner's place in the frame of the cloud's points.
Eigen::Vector3d place_of_scanner(const json& result) {
  const json pose = result.value("base_from_rig", json::array());
  if (pose.size() != 16) return Eigen::Vector3d::Zero();
  return {pose[3].get<double>(), pose[7].get<double>(), pose[11].get<double>()};
}

Result<SeenPlane> plane_of(const Cloud& cloud, const Eigen::Vector3d& scanner, std::optional<double> margin_mm) {
  std::vector<Eigen::Vector3d> points;
  points.reserve(cloud.points.size());
  for (const CloudPoint& point : cloud.points)
    points.push_back(Eigen::Vector3f(point.x, point.y, point.z).cast<double>() - scanner);
  const auto fit = fit_plane(points);
  if (!fit) {
    return fail(ErrorCode::kNotFound, fmt::format("no plane: the scan has {} points; clear the table, and scan with "
                                                  "slsctl scan --picture FILE.png to see what is decoded",
                                                  points.size()));
  }
  const Eigen::Vector3d to_scanner = fit->normal.dot(fit->middle) > 0 ? Eigen::Vector3d(-fit->normal) : fit->normal;
  const double margin = margin_mm.value_or(kMarginInScatters * fit->rms_mm);
  return SeenPlane{*fit, to_scanner, to_scanner.dot(fit->middle + scanner) + margin, margin, points.size()};
}

// Rounded, for people who read them, to a micrometre at a distance of ten metres.
json numbers_of(const SeenPlane& plane) {
  const auto rounded = [](double number, double steps) { return std::round(number * steps) / steps; };
  json numbers = json::array();
  for (int axis = 0; axis < 3; ++axis) numbers.push_back(rounded(plane.to_scanner[axis], 1e7));
  numbers.push_back(rounded(plane.offset_mm, 1e3));
  return numbers;
}

void print(const ClientOptions& options, const SeenPlane& plane, const json& numbers) {
  const double distance_mm = -plane.to_scanner.dot(plane.fit.middle);
  const double tilt_deg = std::acos(std::min(1.0, std::abs(plane.to_scanner.z()))) * kDegrees;
  if (options.json) {
    std::cout << to_line({{"plane", numbers},
                          {"distance_mm", distance_mm},
                          {"tilt_deg", tilt_deg},
                          {"rms_mm", plane.fit.rms_mm},
                          {"margin_mm", plane.margin_mm},
                          {"on_plane", plane.fit.on_plane.size()},
                          {"points", plane.points}});
    return;
  }
  std::cout << fmt::format(
      "{} of {} points lie on a plane {:.1f} mm from the scanner, tilted by {:.1f} degrees; they scatter by {:.3f} mm "
      "(RMS).\n",
      plane.fit.on_plane.size(), plane.points, distance_mm, tilt_deg, plane.fit.rms_mm);
  std::cout << fmt::format("cloud.plane={}  drops them, and all points up to {:.2f} mm in front of it.\n",
                           numbers.dump(), plane.margin_mm);
  std::cout << (options.set ? "It is in force. slsctl set cloud.plane=default undoes it.\n"
                            : "slsctl plane --set puts it in force.\n");
}

}  // namespace

int plane_command(const ClientOptions& options) {
  const auto settings = ask(options, "settings", json::object());
  if (!settings) return report(options, settings.error());
  const json cloud_table =
      settings->reply.message["result"].value("configuration", json::object()).value("cloud", json::object());
  json params{{"density", "symbols"}, {"plane", json::array()}};
  params["coordinate_frame"] = cloud_table.value("box_frame", "rig");
  if (options.timeout_ms) params["timeout_ms"] = *options.timeout_ms;
  const auto scanned = ask(options, "scan", params);
  if (!scanned) return report(options, scanned.error());
  const auto cloud = read_ply(scanned->reply.bytes, "the service's cloud");
  if (!cloud) return report(options, failure(cloud.error()));
  const auto plane = plane_of(*cloud, place_of_scanner(scanned->reply.message["result"]), options.margin_mm);
  if (!plane) return report(options, failure(plane.error()));
  const json numbers = numbers_of(*plane);
  if (options.set) {
    const auto set = ask(options, "set", {{"cloud", {{"plane", numbers}}}});
    if (!set) return report(options, set.error());
  }
  print(options, *plane, numbers);
  return kDone;
}

}  // namespace slsd
