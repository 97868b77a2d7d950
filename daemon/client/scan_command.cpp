// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <iostream>

#include "core/cloud/pcd.hpp"
#include "core/cloud/ply.hpp"
#include "daemon/client/client_commands.hpp"
#include "daemon/client/output.hpp"
#include "daemon/client/report.hpp"
#include "daemon/rpc/message.hpp"
#include "drivers/files/encode_png.hpp"
#include "picture/render_cloud.hpp"

namespace slsd {
namespace {

using nlohmann::json;
using std::filesystem::path;

// Every other pixel of an organised cloud, as the lattice that a picture is drawn of.
constexpr int kPictureStep = 2;

// A record of an organised cloud: x y z sigma_mm intensity as floats, camera as a byte, a normal.
constexpr std::size_t kIntensityAt = 16, kCameraAt = 20;

std::size_t record_bytes(bool normals) {
  return normals ? 33 : 21;
}

float float_at(const char* bytes) {
  float value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

Result<Cloud> lattice_of_pixels(const json& result, std::string_view pcd, bool normals) {
  const std::size_t data = pcd.find("\nDATA binary\n"), record = record_bytes(normals);
  const auto field = [&](std::string_view key) {
    const std::size_t at = pcd.find(key);
    return at >= data ? 0 : std::atoi(pcd.data() + at + key.size());
  };
  const int width = field("\nWIDTH "), height = result.value("height_px", 0);
  const std::size_t begin = data + 13, needed = record * static_cast<std::size_t>(width) * height;
  if (data == std::string_view::npos || width <= 0 || height <= 0 || pcd.size() - begin < needed)
    return fail(ErrorCode::kMalformed, "the daemon's cloud is not organised as its pixels are");
  Cloud cloud;
  cloud.lattice_columns = (width + kPictureStep - 1) / kPictureStep;
  cloud.lattice_rows = (height + kPictureStep - 1) / kPictureStep;
  cloud.scan_id = result.value("scan", ""), cloud.time = result.value("time", "");
  for (int y = 0; y < height; y += kPictureStep) {
    for (int x = 0; x < width; x += kPictureStep) {
      const char* from = pcd.data() + begin + record * (static_cast<std::size_t>(y) * width + x);
      CloudPoint point;
      point.x = float_at(from), point.y = float_at(from + 4), point.z = float_at(from + 8);
      if (!(point.z > 0)) continue;
      point.column = static_cast<std::uint16_t>(x / kPictureStep);
      point.row = static_cast<std::uint16_t>(y / kPictureStep);
      point.intensity = static_cast<std::uint8_t>(float_at(from + kIntensityAt));
      cloud.points.push_back(point);
    }
  }
  return cloud;
}

// The points of an organised cloud that are there, as a PLY, whose intensity is a byte.
std::string dense_ply_of(const json& result, std::string_view pcd, bool normals) {
  const std::size_t begin = pcd.find("\nDATA binary\n") + 13, record = record_bytes(normals);
  std::string points;
  std::size_t count = 0;
  for (std::size_t at = begin; at + record <= pcd.size(); at += record) {
    const std::string_view from = pcd.substr(at, record);
    if (std::isnan(float_at(from.data() + 8))) continue;
    points.append(from.substr(0, kIntensityAt));
    points += static_cast<char>(static_cast<std::uint8_t>(float_at(from.data() + kIntensityAt)));
    points.append(from.substr(kCameraAt));
    ++count;
  }
  std::string ply = "ply\nformat binary_little_endian 1.0\ncomment scan_id " + result.value("scan", "") +
                    "\ncomment time " + result.value("time", "") + "\ncomment frame " +
                    std::to_string(result.value("frame", std::uint64_t{0})) +
                    "\ncomment units mm\ncomment coordinate_frame rig: the first camera's, x right, y down, z forward\n"
                    "element vertex " +
                    std::to_string(count) +
                    "\nproperty float x\nproperty float y\nproperty float z\nproperty float sigma_mm\nproperty uchar "
                    "intensity\nproperty uchar camera\n";
  if (normals) ply += "property float nx\nproperty float ny\nproperty float nz\n";
  return ply + "end_header\n" + points;
}

tl::expected<void, Failure> write_cloud_picture(const path& file, const Result<Cloud>& cloud, std::size_t measured) {
  if (!cloud) return tl::unexpected(failure(cloud.error()));
  const auto png = encode_png(render_cloud(*cloud, {}, measured));
  if (!png) return tl::unexpected(failure(png.error()));
  return write_output(file, *png);
}

// The cloud's picture is drawn from a PLY; a PCD is then made of it here.
tl::expected<void, Failure> write_cloud_file(const ClientOptions& options, std::string_view bytes, bool as_ply) {
  if (options.output.empty()) return {};
  if (!as_ply || options.output.extension() == ".ply") return write_output(options.output, bytes);
  const auto cloud = read_ply(bytes, "the daemon's cloud");
  if (!cloud) return tl::unexpected(failure(cloud.error()));
  return write_output(options.output, write_pcd(*cloud));
}

tl::expected<void, Failure> write_files(const ClientOptions& options, const Answered& answered, bool as_ply,
                                        bool dense) {
  const json& result = answered.reply.message["result"];
  const std::string_view bytes = answered.reply.bytes;
  const bool from_pcd = dense && !options.cloud_picture.empty();  // drawn, and made a PLY of here
  tl::expected<void, Failure> written;
  if (!dense) {
    written = write_cloud_file(options, bytes, as_ply);
  } else if (!options.output.empty()) {
    const bool make_ply = from_pcd && options.output.extension() == ".ply";
    written = make_ply ? write_output(options.output, dense_ply_of(result, bytes, options.normals))
                       : write_output(options.output, bytes);
  }
  if (written && !options.cloud_picture.empty()) {
    written = write_cloud_picture(
        options.cloud_picture,
        dense ? lattice_of_pixels(result, bytes, options.normals) : read_ply(bytes, "the daemon's cloud"),
        result.value("points", std::size_t{0}));
  }
  for (const Received& event : answered.events) {
    const bool picture = event.message.value("method", "") == "picture";
    if (written && picture && !options.picture.empty()) written = write_output(options.picture, event.bytes);
  }
  return written;
}

}  // namespace

int scan_command(const ClientOptions& options) {
  const bool as_ply = options.output.extension() != ".pcd" || !options.cloud_picture.empty();
  const std::string extension = options.output.extension();
  std::string density = options.density;
  const bool tiff = extension == ".tiff" || extension == ".tif", drawn = !options.cloud_picture.empty();
  if (density.empty() && drawn) {  // which format is drawn from depends on it
    const auto settings = ask(options, "settings", json::object());
    if (!settings) return report(options, settings.error());
    const json& configured = settings->reply.message["result"]["configuration"];
    density = configured.value("decode", json::object()).value("density", "symbols");
  }
  const bool dense = density == "pixels";
  if (dense && drawn && tiff) {
    return report(
        options,
        {kRequestFailed,
         rpc_error({ErrorCode::kInvalidArgument, "a picture is drawn of a cloud: write it as .ply or .pcd", {}})});
  }
  const bool as_pcd = dense ? drawn || extension == ".pcd" : !as_ply;
  json params{{"format", tiff ? "tiff" : as_pcd ? "pcd" : "ply"}, {"picture", !options.picture.empty()}};
  if (!density.empty()) params["density"] = density;
  if (options.normals) params["normals"] = true;
  if (options.texture) params["texture"] = true;
  if (options.ambient) params["ambient"] = true;
  if (options.timeout_ms) params["timeout_ms"] = *options.timeout_ms;
  const auto answered = ask(options, "scan", params);
  if (!answered) return report(options, answered.error());
  const bool of_pixels = answered->reply.message["result"].value("density", "") == "pixels";
  if (auto written = write_files(options, *answered, as_ply, of_pixels); !written)
    return report(options, written.error());
  const json& result = answered->reply.message["result"];
  std::cout << (options.json ? to_line(result) : scan_line(result) + "\n" + empty_line(result));
  return kDone;
}

}  // namespace slsd
