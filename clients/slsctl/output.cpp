// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/slsctl/output.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <iostream>
#include <utility>

#include "core/mesh/mesh_file.hpp"
#include "core/printable.hpp"
#include "drivers/files/file.hpp"
#include "drivers/system/system_error.hpp"

namespace slsd {
namespace {

using std::filesystem::path;

constexpr std::array<std::pair<const char*, const char*>, 7> kCloudFormats{{{".ply", "ply"},
                                                                            {".pcd", "pcd"},
                                                                            {".tiff", "tiff"},
                                                                            {".tif", "tiff"},
                                                                            {".stl", "stl"},
                                                                            {".obj", "obj"},
                                                                            {".glb", "glb"}}};

/// Empty if the name has none of the known extensions.
std::string format_named(const path& file) {
  const std::string extension = lower_extension(file);
  const auto found = std::ranges::find(kCloudFormats, extension, [](const auto& each) { return each.first; });
  return found == kCloudFormats.end() ? "" : found->second;
}

std::string quoted(const path& file) {
  return "\"" + printable(file.string(), 200) + "\"";
}

std::string wrong_cloud(const ClientOptions& options) {
  if (is_standard_output(options.output)) return {};
  const std::string named = format_named(options.output);
  if (named.empty() && options.format.empty())
    return quoted(options.output) +
           ": write a cloud as .ply or .pcd, a depth map as .tiff, a mesh as .stl, .obj or .glb, or add "
           "--format";
  if (!named.empty() && !options.format.empty() && named != options.format)
    return quoted(options.output) + " does not match --format " + options.format;
  return {};
}

/// @param extension  the command's own extension; a name without any is fine
std::string wrong_name(const path& file, const std::string& extension, const std::string& what) {
  const std::string given = lower_extension(file);
  if (file.empty() || given.empty() || given == extension) return {};
  return quoted(file) + ": " + what + " is written as " + extension + " only";
}

std::string wrong_mesh(const ClientOptions& options) {
  if (!is_mesh(options)) return {};
  if (options.output.empty()) return "--mesh needs a file to write: .ply, .stl, .obj or .glb";
  if (!mesh_format(cloud_format(options))) return "a mesh is written as .ply, .stl, .obj or .glb";
  if (options.density == "symbols") return "a mesh needs --density pixels: symbols are too far apart to tell edges";
  if (options.normals) return "a mesh has the normals of its triangles: leave out --normals";
  if (options.stride.value_or(1) > 1 || options.voxel_mm.value_or(0) > 0)
    return "a mesh joins adjacent pixels: leave out --stride and --voxel-mm";
  return {};
}

std::string wrong_depth_map(const ClientOptions& options) {
  if (cloud_format(options) != "tiff") {
    const bool symbols = options.normals && options.density == "symbols";
    return symbols ? "--normals needs --density pixels" : "";
  }
  if (options.density == "symbols") return "a depth map needs --density pixels";
  if (options.normals) return "a depth map has no normals: write the cloud as .ply or .pcd";
  if (!options.cloud_picture.empty()) return "--cloud-picture needs a cloud: write it as .ply or .pcd";
  return {};
}

}  // namespace

bool is_standard_output(const path& file) {
  return file == "-";
}

std::vector<path> outputs_of(const ClientOptions& options) {
  std::vector<path> files{options.output, options.picture, options.cloud_picture, options.image};
  std::erase(files, path());
  return files;
}

std::ostream& words(const ClientOptions& options) {
  const auto files = outputs_of(options);
  return std::ranges::any_of(files, is_standard_output) ? std::cerr : std::cout;
}

std::string cloud_format(const ClientOptions& options) {
  if (!options.format.empty()) return options.format;
  return options.output.empty() || is_standard_output(options.output) ? "ply" : format_named(options.output);
}

bool is_mesh(const ClientOptions& options) {
  const std::string format = cloud_format(options);
  return options.mesh || (format != "ply" && mesh_format(format));
}

std::string wrong_outputs(const ClientOptions& options, const std::string& command) {
  const auto files = outputs_of(options);
  const auto on_standard_output = std::ranges::count_if(files, is_standard_output);
  if (is_standard_output(options.folder))
    return "a recording is a folder and cannot go to standard output: name a folder";
  if (on_standard_output > 1) return "standard output (-) takes one file only";
  std::string wrong;
  if (command == "scan" && !options.output.empty()) wrong = wrong_cloud(options);
  if (command == "scan" && wrong.empty()) wrong = wrong_mesh(options);
  if (command == "scan" && wrong.empty()) wrong = wrong_depth_map(options);
  if (command == "record" && options.normals && options.density == "symbols")
    wrong = "--normals needs --density pixels";
  if (options.stride.value_or(1) > 1 && options.density == "symbols") wrong = "--stride needs --density pixels";
  if (command == "bundle") wrong = wrong_name(options.output, ".tar", "a bundle");
  for (const path& picture : {options.picture, options.cloud_picture, options.image})
    if (wrong.empty()) wrong = wrong_name(picture, ".png", "a picture");
  if (wrong.empty() && on_standard_output > 0 && command != "metrics" && ::isatty(STDOUT_FILENO) == 1)
    wrong =
        "standard output is a terminal, which cannot show this file: redirect it, as in \"> FILE\" or \"| PROGRAM\"";
  return wrong;
}

tl::expected<void, Failure> check_outputs(const ClientOptions& options) {
  for (const path& file : outputs_of(options)) {
    if (is_standard_output(file)) continue;
    if (auto place = check_writable(file); !place)
      return tl::unexpected(Failure{kRequestFailed, rpc_error(place.error())});
  }
  return {};
}

tl::expected<void, Failure> write_output(const path& file, std::string_view bytes) {
  Result<> written;
  if (!is_standard_output(file)) {
    written = write_file_atomically(file, bytes);
  } else if (!std::cout.write(bytes.data(), static_cast<std::streamsize>(bytes.size())).flush()) {
    written = tl::unexpected(system_error(errno, "cannot write", "standard output"));
  }
  if (!written) return tl::unexpected(Failure{kRequestFailed, rpc_error(written.error())});
  return {};
}

int finish(const ClientOptions& options, int exit_status) {
  if (words(options).flush()) return exit_status;
  std::cerr << "slsctl: cannot write to standard output: check whether its disk is full\n";
  return exit_status == kDone ? kRequestFailed : exit_status;
}

}  // namespace slsd
