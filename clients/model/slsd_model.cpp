// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "clients/model/build_model.hpp"
#include "clients/usage/usage.hpp"
#include "core/mesh/mesh_file.hpp"
#include "drivers/files/file.hpp"

namespace {

using namespace slsd;

int failed(const Error& error) {
  std::fprintf(stderr, "slsd-model: %s\n", to_string(error).c_str());
  return 1;
}

nlohmann::json to_json(const model::ModelReport& report, const Mesh& mesh) {
  nlohmann::json refused = nlohmann::json::array();
  for (const model::RefusedFrame& frame : report.refused)
    refused.push_back({{"frame", frame.name}, {"reason", frame.reason}});
  nlohmann::json fused = nlohmann::json::array();
  for (const model::FusedFrame& frame : report.fused) {
    const RigidTransform& pose = frame.object_from_rig;
    nlohmann::json rows = nlohmann::json::array();
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column) rows.push_back(pose.rotation(row, column));
    fused.push_back({{"frame", frame.name},
                     {"rotation", std::move(rows)},
                     {"translation_mm", {pose.translation.x(), pose.translation.y(), pose.translation.z()}},
                     {"residual_over_sigma", frame.fit}});
  }
  const model::Adjustment& adjustment = report.adjustment;
  nlohmann::json json{{"frames", report.frames},
                      {"fused", std::move(fused)},
                      {"refused", std::move(refused)},
                      {"turned_degrees", report.turned_degrees},
                      {"links", adjustment.links},
                      {"closed", adjustment.closed},
                      {"residual_over_sigma", adjustment.over_sigma},
                      {"voxel_mm", report.voxel_mm},
                      {"volume_bytes", report.volume_bytes},
                      {"vertices", mesh.vertices_mm.size()},
                      {"triangles", mesh.triangles.size()},
                      {"sigma_mm", report.usual_sigma_mm}};
  if (adjustment.closed) json["drift_mm"] = adjustment.drift_mm, json["seam_mm"] = adjustment.seam_mm;
  return json;
}

std::string to_text(const model::ModelReport& report, const Mesh& mesh) {
  const model::Adjustment& adjustment = report.adjustment;
  std::string text =
      fmt::format("{} of {} frames fused, {:.0f} degrees turned\nresiduals: {:.2f} sigma, over {} pairs of frames\n",
                  report.fused.size(), report.frames, report.turned_degrees, adjustment.over_sigma, adjustment.links);
  text += adjustment.closed ? fmt::format("closed: {:.3f} mm of drift before, {:.3f} mm of seam after\n",
                                          adjustment.drift_mm, adjustment.seam_mm)
                            : "not closed: no frame at the end shows what one at the beginning shows\n";
  return text + fmt::format("mesh: {} triangles, usual sigma {:.3f} mm, voxels of {:.2f} mm\n", mesh.triangles.size(),
                            report.usual_sigma_mm, report.voxel_mm);
}

struct Options {
  std::filesystem::path recording, output;
  model::ModelOptions model;
  bool json = false;
};

int run(const Options& options) {
  const auto format = mesh_format(lower_extension(options.output).substr(1));
  if (auto writable = check_writable(options.output); !writable) return failed(writable.error());
  const auto recorded = model::read_recording(options.recording);
  if (!recorded) return failed(recorded.error());
  for (const std::string& warning : recorded->warnings) std::fprintf(stderr, "slsd-model: %s\n", warning.c_str());
  const auto built = model::build_model(*recorded, options.model, [](const std::string& sentence) {
    std::fprintf(stderr, "slsd-model: %s\n", sentence.c_str());
  });
  if (!built) return failed(built.error());
  const auto bytes = write_mesh(built->mesh, *format, "slsd-model of " + options.recording.filename().string());
  if (!bytes) return failed(bytes.error());
  if (auto written = write_file_atomically(options.output, *bytes); !written) return failed(written.error());
  const std::string report =
      options.json ? to_json(built->report, built->mesh).dump() + "\n" : to_text(built->report, built->mesh);
  return std::fputs(report.c_str(), stdout) < 0 || std::fflush(stdout) != 0 ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Fuses the clouds of an object that turns in front of the scanner into one mesh.\nExit status: 0 done, 1 no "
      "model, "
      "2 wrong usage.",
      "slsd-model");
  Options options;
  app.set_version_flag("--version", "slsd-model " SLSD_VERSION);
  app.add_option("--from", options.recording, "the folder of a recording of slsctl that has clouds");
  app.add_option("-o,--output", options.output, "the mesh: .ply, .stl, .obj or .glb");
  app.add_option("--voxel", options.model.voxel_mm, "the mesh's resolution in mm (by the clouds' pixels and sigmas)")
      ->check(between(0.01, 100.0));
  app.add_flag("--json", options.json, "print the report as JSON");
  const auto check = [&options] {
    if (options.recording.empty()) throw CLI::ValidationError("--from", "name the folder of a recording");
    const std::string extension = lower_extension(options.output);
    if (extension.empty() || !mesh_format(extension.substr(1)))
      throw CLI::ValidationError("--output", "the file's name ends in .ply, .stl, .obj or .glb");
  };
  if (const auto ended = parse_usage(app, argc, argv, check)) return *ended;
  return run(options);
}
