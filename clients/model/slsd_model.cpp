// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <slsd/connection.hpp>

#include "clients/model/build_model.hpp"
#include "clients/model/live_clouds.hpp"
#include "clients/model/live_session.hpp"
#include "clients/model/mesh/mesh_3mf.hpp"
#include "clients/model/progress/progress.hpp"
#include "clients/model/recorded_clouds.hpp"
#include "clients/usage/usage.hpp"
#include "core/mesh/mesh_file.hpp"
#include "drivers/files/file.hpp"
#include "drivers/system/interrupt.hpp"

namespace {

using namespace slsd;

constexpr const char* k3mf = ".3mf";

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
                      {"sigma_mm", report.usual_sigma_mm},
                      {"invented_share", report.invented_share}};
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
                            : "not closed: the last frames do not overlap the first ones\n";
  if (report.invented_share > 0)
    text += fmt::format("invented to close the holes: {:.1f} % of the surface, with frames = 0 in the PLY\n",
                        100 * report.invented_share);
  return text + fmt::format("mesh: {} triangles, median sigma {:.3f} mm, voxels of {:.2f} mm\n", mesh.triangles.size(),
                            report.usual_sigma_mm, report.voxel_mm);
}

struct Options {
  std::filesystem::path socket = client::default_socket();
  std::filesystem::path recording, keep, background, preview;
  std::vector<std::filesystem::path> outputs;
  std::vector<float> box_mm;  ///< least x, y, z, then greatest
  bool turntable = false, colour = false;
  model::LiveOptions live;
  model::ModelOptions model;
  bool json = false, progress = false;
};

/// @param clouds  which may give their room to the model; null: none
Result<> write_model(const std::filesystem::path& file, const Mesh& mesh, const std::string& title,
                     model::LiveClouds* clouds) {
  const std::string extension = lower_extension(file);
  const auto bytes =
      extension == k3mf ? model::write_3mf(mesh, title) : write_mesh(mesh, *mesh_format(extension.substr(1)), title);
  if (!bytes) return tl::unexpected(bytes.error());
  auto written = write_file_atomically(file, *bytes);
  if (!written && written.error().code == ErrorCode::kNoSpace && clouds && clouds->make_room(file, bytes->size()))
    written = write_file_atomically(file, *bytes);
  return written;
}

/// Writes the model into each file. One that cannot be written keeps no other from it.
Result<> write_models(const Options& options, const Mesh& mesh, const std::string& subject, model::Progress& progress,
                      model::LiveClouds* clouds) {
  Result<> all;
  for (const std::filesystem::path& file : options.outputs) {
    auto written = write_model(file, mesh, "slsd-model of " + subject, clouds);
    if (written) continue;
    if (!all) progress.say(to_string(all.error()));
    all = std::move(written);
  }
  return all;
}

bool print_report(const Options& options, const model::Model& made, model::Progress& progress) {
  if (options.progress) return progress.report(to_json(made.report, made.mesh));
  const std::string report =
      options.json ? to_json(made.report, made.mesh).dump() + "\n" : to_text(made.report, made.mesh);
  return std::fputs(report.c_str(), stdout) >= 0 && std::fflush(stdout) == 0;
}

/// Writes the model and its report. @param clouds  of a session; null: of a recording @return the exit status
int deliver(const Options& options, const Result<model::Model>& built, const std::string& subject,
            model::Progress& progress, model::LiveClouds* clouds) {
  if (!built) return progress.fail(built.error());
  if (auto written = write_models(options, built->mesh, subject, progress, clouds); !written) {
    const std::filesystem::path folder = clouds ? clouds->keep_folder() : std::filesystem::path();
    if (!folder.empty())
      written.error().message += "; the clouds are kept: then build the model again with --from " + folder.string();
    return progress.fail(written.error());
  }
  progress.finish(built->mesh);
  if (print_report(options, *built, progress)) return 0;
  std::fputs("slsd-model: cannot write the report to standard output: check whether its disk is full\n", stderr);
  return 1;
}

/// @param taker  a ModelBuilder or a LiveSession
template <class Taker>
Result<> give_background(const Options& options, Taker& taker) {
  if (options.background.empty()) return {};
  constexpr std::size_t kLargestBytes = std::size_t{1} << 31;
  const auto ply = read_file(options.background, kLargestBytes);
  if (!ply) return tl::unexpected(ply.error());
  return taker.set_background(*ply).map_error([&](Error error) {
    error.where = options.background.string();
    return error;
  });
}

int run_recorded(const Options& options, model::Progress& progress) {
  const auto recorded = model::read_recording(options.recording);
  if (!recorded) return progress.fail(recorded.error());
  for (const std::string& warning : recorded->warnings) progress.say(warning);
  const auto read = [&recorded](const std::string& name) { return model::read_recorded(*recorded, name); };
  model::ModelBuilder builder(recorded->calibration, options.model);
  if (auto given = give_background(options, builder); !given) return progress.fail(given.error());
  for (const std::string& name : recorded->names) {
    const auto ply = read(name);
    std::string refusal;
    if (ply) {
      const auto added = builder.add(name, *ply);
      if (!added) return progress.fail(added.error());
      refusal = added->refusal;
      if (added->found_again) progress.say(name + ": found the object again");
    } else {
      refusal = ply.error().message;
      builder.leave_out(name, refusal);
    }
    if (!refusal.empty()) progress.say(name + ": left out: " + refusal);
    progress.add_cloud(builder, builder.sides(), refusal);
  }
  const auto tell = [&progress](const std::string& sentence) { progress.say(sentence); };
  const auto advance = [&progress](std::size_t done, std::size_t clouds) { progress.build(done, clouds); };
  return deliver(options, builder.finish(read, tell, advance), options.recording.filename().string(), progress,
                 nullptr);
}

int run_live(const Options& options, model::Progress& progress) {
  Interrupt::watch();
  auto clouds = model::LiveClouds::open(
      options.socket, options.keep.empty() ? std::nullopt : std::optional<std::filesystem::path>(options.keep));
  if (!clouds) return progress.fail(clouds.error());
  if (options.colour) clouds->want_colour();
  const auto tell = [&progress](const std::string& sentence) { progress.say(sentence); };
  const auto on_cloud = [&progress](const model::ModelBuilder& builder, const model::SeenSides& sides,
                                    const std::string& left_out) { progress.add_cloud(builder, sides, left_out); };
  model::LiveSession session(std::move(*clouds), options.model, options.live, tell, on_cloud);
  if (auto given = give_background(options, session); !given) return progress.fail(given.error());
  const Result<> ended = session.follow();
  if (!ended) {
    if (session.placed() == 0) return progress.fail(ended.error());
    progress.say(to_string(ended.error()) + "; the model is built from the clouds before that");
  }
  const auto advance = [&progress](std::size_t done, std::size_t all) { progress.build(done, all); };
  const int status = deliver(options, session.finish(advance), "clouds of the scanner", progress, &session.clouds());
  return status == 0 && !ended ? 1 : status;
}

int run(Options options) {
  if (options.box_mm.size() == 6) {
    const std::vector<float>& box = options.box_mm;
    options.model.box = model::Box(Eigen::Vector3f(box[0], box[1], box[2]), Eigen::Vector3f(box[3], box[4], box[5]));
  }
  if (options.turntable) options.model.step_degrees = 360.0 / options.live.views;
  model::Progress progress(options.progress, options.preview);
  for (const std::filesystem::path& file : options.outputs)
    if (auto writable = check_writable(file); !writable) return progress.fail(writable.error());
  return options.recording.empty() ? run_live(options, progress) : run_recorded(options, progress);
}

void check(const Options& options) {
  const auto is_mesh = [](const std::filesystem::path& file) {
    const std::string extension = lower_extension(file);
    return extension == k3mf || (!extension.empty() && mesh_format(extension.substr(1)));
  };
  if (options.outputs.empty() || !std::ranges::all_of(options.outputs, is_mesh))
    throw CLI::ValidationError("--output", "the file's name ends in .ply, .stl, .obj, .glb or .3mf");
  if (options.turntable && options.live.views == 0)
    throw CLI::ValidationError("--turntable", "give the number of views in a full turn, such as --views 24");
  const std::vector<float>& box = options.box_mm;
  for (std::size_t axis = 0; axis < 3 && !box.empty(); ++axis)
    if (!(box[axis] < box[axis + 3]))
      throw CLI::ValidationError("--box", "the first three are the least x, y and z, the others the greatest");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Fuses the clouds of an object that turns in front of the scanner into one mesh.\nExit status: 0 done, 1 no "
      "model or the session failed, 2 wrong usage.",
      "slsd-model");
  Options options;
  app.set_version_flag("--version", "slsd-model " SLSD_VERSION);
  app.add_option("-o,--output", options.outputs, "the mesh to write: .ply, .stl, .obj, .glb or .3mf; may be repeated")
      ->allow_extra_args(false);
  auto* const from =
      app.add_option("--from", options.recording, "use the clouds of this recording of slsctl instead of scanning");
  const auto live = [&](CLI::Option* option) { return option->excludes(from); };
  live(app.add_option("--socket", options.socket,
                      "the service's socket; default: SLSD_SOCKET if set (" + options.socket.string() + ")"));
  auto* const turntable = live(
      app.add_flag("--turntable", options.turntable, "scan one view for each line on standard input, such as Enter"));
  live(app.add_option("--views", options.live.views, "with --turntable: the number of views in a full turn"))
      ->check(between(8, 360))
      ->needs(turntable);
  live(app.add_flag("--colour", options.colour, "with --turntable: give the mesh the surface's colours"))
      ->needs(turntable);
  live(app.add_flag("--until-closed", options.live.until_closed,
                    "end when the scanner has seen the object from all sides"))
      ->excludes(turntable);
  live(app.add_option("--seconds", options.live.seconds, "end after this many seconds"))
      ->check(between(0.1, 86400.0))
      ->excludes(turntable);
  live(app.add_option("--keep", options.keep, "keep the clouds in this new folder, for --from"));
  app.add_option("--box", options.box_mm,
                 "use only points in this box: least x y z, then greatest x y z, in mm in the rig's frame")
      ->expected(6);
  app.add_option("--background", options.background,
                 "leave out the surfaces in this dense cloud (PLY) of the empty scene, such as table and wall");
  app.add_option("--voxel", options.model.voxel_mm, "the mesh's resolution in mm (from the clouds' pixels and sigmas)")
      ->check(between(0.01, 100.0));
  app.add_flag("--close", options.model.close,
               "close the holes for 3D printing: invents surface where none was measured");
  app.add_option("--preview", options.preview, "write points of the growing model to this PLY file");
  auto* const json = app.add_flag("--json", options.json, "print the report as JSON");
  app.add_flag("--progress", options.progress, "print progress and then the report, as lines of JSON")->excludes(json);
  if (const auto ended = parse_usage(app, argc, argv, [&options] { check(options); })) return *ended;
  return run(options);
}
