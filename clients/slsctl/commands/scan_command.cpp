// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <ostream>

#include "clients/slsctl/asked_part.hpp"
#include "clients/slsctl/commands/client_commands.hpp"
#include "clients/slsctl/output.hpp"
#include "clients/slsctl/progress.hpp"
#include "clients/slsctl/report.hpp"
#include "core/cloud/coordinate_frame.hpp"
#include "core/cloud/dense_file.hpp"
#include "core/cloud/pcd.hpp"
#include "core/cloud/ply.hpp"
#include "core/dense/dense_map.hpp"
#include "core/mesh/mesh_file.hpp"
#include "core/mesh/mesh_grid.hpp"
#include "drivers/files/encode_png.hpp"
#include "picture/cloud/render_cloud.hpp"
#include "rpc/message.hpp"

namespace slsd {
namespace {

using nlohmann::json;
using std::filesystem::path;

// Every other pixel of an organised cloud forms the lattice of the picture.
constexpr int kPictureStep = 2;

DenseFacts facts_of(const json& result, bool normals) {
  return {.scan_id = result.value("scan", ""),
          .time = result.value("time", ""),
          .frame = result.value("frame", std::uint64_t{0}),
          .normals = normals};
}

Result<DensePcd> pixels_of(const json& result, std::string_view bytes, bool normals) {
  return DensePcd::open(bytes, result.value("height_px", 0), normals);
}

Result<Cloud> lattice_of_pixels(const json& result, std::string_view bytes, bool normals) {
  const auto pixels = pixels_of(result, bytes, normals);
  if (!pixels) return tl::unexpected(pixels.error());
  Cloud cloud = pixels->lattice(kPictureStep);
  cloud.scan_id = result.value("scan", ""), cloud.time = result.value("time", "");
  return cloud;
}

tl::expected<void, Failure> write_cloud_picture(const path& file, const Result<Cloud>& cloud, std::size_t measured) {
  if (!cloud) return tl::unexpected(failure(cloud.error()));
  const auto png = encode_png(render_cloud(*cloud, {}, measured));
  if (!png) return tl::unexpected(failure(png.error()));
  return write_output(file, *png);
}

// slsctl itself draws a cloud's picture, of symbols from a PLY, of pixels from a PCD, and joins pixels to a mesh. It
// then makes the file from the same data.
std::string asked_format(const ClientOptions& options, bool dense) {
  if (is_mesh(options)) return "pcd";
  if (options.cloud_picture.empty()) return cloud_format(options);
  return dense ? "pcd" : "ply";
}

Result<std::string> mesh_of(const ClientOptions& options, const json& result, std::string_view bytes) {
  const auto pixels = pixels_of(result, bytes, options.normals);
  if (!pixels) return tl::unexpected(pixels.error());
  Mesh surface = mesh_grid(pixels->grid(), kDepthJump);
  if (const auto& base_from_rig = pixels->base_from_rig()) {
    for (Eigen::Vector3f& vertex : surface.vertices_mm) vertex = (*base_from_rig * vertex.cast<double>()).cast<float>();
  }
  auto mesh = write_mesh(surface, *mesh_format(cloud_format(options)),
                         "scan " + result.value("scan", "") + ", " + result.value("time", ""));
  if (!mesh && mesh.error().code == ErrorCode::kNotFound)
    mesh.error().message += ": slsctl scan --picture FILE.png --why shows what was rejected";
  return mesh;
}

tl::expected<void, Failure> write_cloud(const ClientOptions& options, const json& result, std::string_view bytes,
                                        bool dense) {
  if (options.output.empty()) return {};
  if (is_mesh(options)) {
    const auto mesh = mesh_of(options, result, bytes);
    if (!mesh) return tl::unexpected(Failure{kRequestFailed, rpc_error(mesh.error())});
    return write_output(options.output, *mesh);
  }
  if (asked_format(options, dense) == cloud_format(options)) return write_output(options.output, bytes);
  if (dense) {
    const auto pixels = pixels_of(result, bytes, options.normals);
    if (!pixels) return tl::unexpected(failure(pixels.error()));
    return write_output(options.output, pixels->to_ply(facts_of(result, options.normals)));
  }
  const auto cloud = read_ply(bytes, "the service's cloud");
  if (!cloud) return tl::unexpected(failure(cloud.error()));
  const auto base_from_rig = base_from_rig_of(bytes.substr(0, bytes.find("element vertex")));
  return write_output(options.output, write_pcd(*cloud, base_from_rig ? &*base_from_rig : nullptr));
}

tl::expected<void, Failure> write_files(const ClientOptions& options, const Answered& answered) {
  const json& result = answered.reply.message["result"];
  const std::string_view bytes = answered.reply.bytes;
  const bool dense = result.value("density", "") == "pixels";
  auto written = write_cloud(options, result, bytes, dense);
  if (written && !options.cloud_picture.empty()) {
    written = write_cloud_picture(
        options.cloud_picture,
        dense ? lattice_of_pixels(result, bytes, options.normals) : read_ply(bytes, "the service's cloud"),
        result.value("points", std::size_t{0}));
  }
  for (const Received& event : answered.events) {
    const bool picture = event.message.value("method", "") == "picture";
    if (written && picture && !options.picture.empty()) written = write_output(options.picture, event.bytes);
  }
  return written;
}

/// The density to request; empty: the service's configured one. The format for the picture depends on it.
tl::expected<std::string, Failure> asked_density(const ClientOptions& options, Connection& connection) {
  if (!options.density.empty()) return options.density;
  if (options.normals || is_mesh(options) || cloud_format(options) == "tiff") return "pixels";
  if (options.cloud_picture.empty()) return "";
  const auto settings = ask(connection, "settings", json::object());
  if (!settings) return tl::unexpected(settings.error());
  const json configured = settings->reply.message["result"].value("configuration", json::object());
  return configured.value("decode", json::object()).value("density", "symbols");
}

json scan_parameters(const ClientOptions& options, const std::string& density) {
  json params{{"format", asked_format(options, density == "pixels")}, {"picture", !options.picture.empty()}};
  if (options.why) params["why"] = true;
  if (!density.empty()) params["density"] = density;
  if (!options.camera.empty()) params["camera"] = options.camera;
  params.update(asked_part(options));
  if (is_mesh(options)) params["stride"] = 1, params["voxel_mm"] = 0;  // a configured one would tear the surface
  if (!options.preset.empty()) params["preset"] = options.preset;
  if (!options.coordinate_frame.empty()) params["coordinate_frame"] = options.coordinate_frame;
  if (!options.robot_pose.empty()) params["robot_pose"] = options.robot_pose, params["poses"] = options.pose_notation;
  if (options.normals) params["normals"] = true;
  if (options.colour) params["colour"] = true;
  if (options.texture) params["texture"] = true;
  if (options.ambient) params["ambient"] = true;
  if (options.timeout_ms) params["timeout_ms"] = *options.timeout_ms;
  return params;
}

tl::expected<Answered, Failure> scan(const ClientOptions& options) {
  auto connection = Connection::open(options.socket);
  if (!connection) return tl::unexpected(failure(connection.error()));
  const auto density = asked_density(options, *connection);
  if (!density) return tl::unexpected(density.error());
  const Progress progress(options, *connection, *density == "pixels" ? "measuring every pixel" : "scanning");
  return ask(*connection, "scan", scan_parameters(options, *density));
}

}  // namespace

int scan_command(const ClientOptions& options) {
  if (auto writable = check_outputs(options); !writable) return report(options, writable.error());
  const auto answered = scan(options);
  if (!answered) return report(options, answered.error());
  if (auto written = write_files(options, *answered); !written) return report(options, written.error());
  const json& result = answered->reply.message["result"];
  words(options) << (options.json ? to_line(result)
                                  : scan_line(result) + "\n" + empty_line(result) + reason_lines(result));
  return kDone;
}

}  // namespace slsd
