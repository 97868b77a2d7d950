// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>
#include <tl/expected.hpp>

#include <slsd/connection.hpp>

#include "clients/web/model/model_program.hpp"
#include "clients/web/request.hpp"

namespace slsd::web {

/// A model of an object that turns, which all browsers share: slsd-model, which scans and fuses, and the folder of its
/// clouds and files.
///
///     none --start--> following --stop, or all sides seen--> building --> done, failed
///      ^                  |                                     ^          |
///      +-----clear--------+------(the page ends)--> cut --build-+--build---+
///
/// The folder outlives the page, and with it the clouds, from which `build` makes the model again. A finished model is
/// kept, and can be downloaded, until another one takes its place: a build that fails leaves it.
/// @thread thread-safe
class ModelSession {
 public:
  ModelSession(std::filesystem::path folder, std::filesystem::path socket);

  /// The session: its state, progress, sentences, error, and the `report` and `formats` of the finished model. In
  /// another state than "done" these are of the model before.
  [[nodiscard]] nlohmann::json state() const;
  /// Carries out what the page asks for:
  ///
  ///     start              a new model, with the optional `until_closed`, or `turntable`, its `views` and `colour`;
  ///                        `close`, `use_background`, `box`, `voxel_mm`. The model before is deleted
  ///     next               scan the next view of the turntable
  ///     stop               build the model of the clouds so far
  ///     build              build it again of the kept clouds, with `close`, `use_background`, `box`, `voxel_mm`
  ///     clear              end without a model; delete clouds and files
  ///     forget_background  delete the cloud of the empty scene
  ///
  /// @return as state()
  [[nodiscard]] tl::expected<nlohmann::json, Refusal> act(const nlohmann::json& body);
  /// Keeps a dense cloud of the scene without the object.
  [[nodiscard]] std::optional<Refusal> keep_background(std::string_view ply);

  /// @return points of the model so far, a PLY
  [[nodiscard]] tl::expected<client::Bytes, Refusal> preview() const;
  /// @param format  "ply", "stl", "obj", "glb" or "3mf"
  [[nodiscard]] tl::expected<client::Bytes, Refusal> file(std::string_view format) const;

  /// Ends the program, for the end of the page. The clouds are kept.
  void end();

 private:
  [[nodiscard]] std::optional<Refusal> start(const nlohmann::json& choices);
  [[nodiscard]] std::optional<Refusal> build(const nlohmann::json& choices);
  [[nodiscard]] std::optional<Refusal> run(std::vector<std::string> arguments, const nlohmann::json& choices,
                                           const char* state);
  [[nodiscard]] std::optional<Refusal> check_background(const nlohmann::json& choices) const;
  [[nodiscard]] std::optional<Refusal> stop();
  [[nodiscard]] std::optional<Refusal> next();
  void clear();
  void forget();
  void note(const nlohmann::json& line);
  void note_end(const ModelProgram::End& end);
  [[nodiscard]] Result<> end_rebuild(bool done);
  [[nodiscard]] bool runs() const;
  [[nodiscard]] std::size_t kept_clouds() const;

  std::filesystem::path folder_, socket_;
  std::mutex acting_;         ///< guards the next two
  bool ended_ = false;        ///< with the page
  mutable std::mutex mutex_;  ///< guards all below but the program
  std::string state_ = "none";
  nlohmann::json choices_ = nlohmann::json::object();
  nlohmann::json progress_, building_, error_;
  nlohmann::json report_;           ///< of the model in the folder
  nlohmann::json new_report_;       ///< of the one that is made
  nlohmann::json progress_before_;  ///< of the model in the folder, while one is made
  std::filesystem::path made_in_;   ///< the folder itself, or one in it while a finished model is kept
  std::deque<std::string> messages_;
  std::uint64_t previews_ = 0;             ///< how many there were
  std::size_t asked_views_ = 0;            ///< of the turntable
  bool abandoned_ = false;                 ///< the program is killed
  std::unique_ptr<ModelProgram> program_;  ///< last: its thread uses all above
};

}  // namespace slsd::web
