// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/web/model/model_session.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <system_error>
#include <utility>

#include "core/result.hpp"
#include "drivers/files/file.hpp"
#include "drivers/system/file_descriptor.hpp"

namespace slsd::web {
namespace {

using nlohmann::json;
using std::filesystem::path;

constexpr std::array<std::string_view, 5> kModelFormats{"ply", "stl", "obj", "glb", "3mf"};
constexpr std::size_t kMessagesMax = 100;
constexpr std::size_t kSessionBytesMax = 1 << 20;

// Files of a model that is built while another one is kept.
constexpr const char* kNewFolder = "new";

constexpr const char* kFollowing = "following";
constexpr const char* kBuilding = "building";

Refusal invalid(std::string message) {
  return {400, "invalid_params", std::move(message)};
}

Refusal not_now(std::string message) {
  return {409, "not_now", std::move(message)};
}

Refusal failed(const Error& error) {
  return {502, std::string(to_string(error.code)), to_string(error)};
}

bool has_true(const json& choices, const char* key) {
  const auto found = choices.find(key);
  return found != choices.end() && *found == true;
}

bool is_number_in(const json& value, double least, double most) {
  return value.is_number() && value.get<double>() >= least && value.get<double>() <= most;
}

bool is_box(const json& value) {
  if (!value.is_array() || value.size() != 6) return false;
  if (!std::ranges::all_of(value, [](const json& each) { return is_number_in(each, -1e6, 1e6); })) return false;
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (!(value[axis].get<double>() < value[axis + 3].get<double>())) return false;
  return true;
}

/// The choices of a request. @param modes  also those that say how the object turns
tl::expected<json, Refusal> choices_of(const json& body, bool modes) {
  std::vector<std::string> known{"action", "close", "use_background", "box", "voxel_mm"};
  if (modes) known.insert(known.end(), {"until_closed", "turntable", "colour", "views"});
  if (auto refused = unknown_parameter(body, known)) return tl::unexpected(*refused);
  for (const char* flag : {"close", "use_background", "until_closed", "turntable", "colour"}) {
    const auto value = body.find(flag);
    if (value != body.end() && !value->is_boolean())
      return tl::unexpected(invalid("\"" + std::string(flag) + "\" must be true or false"));
  }
  json choices = body;
  choices.erase("action");
  if (choices.contains("box") && !is_box(choices["box"]))
    return tl::unexpected(invalid("\"box\" must be the least x, y and z, and the greatest, mm"));
  if (choices.contains("voxel_mm") && !is_number_in(choices["voxel_mm"], 0.01, 100))
    return tl::unexpected(invalid("\"voxel_mm\" must be 0.01 to 100"));
  if (choices.contains("views") && (!choices["views"].is_number_integer() || !is_number_in(choices["views"], 8, 360)))
    return tl::unexpected(invalid("\"views\" must be 8 to 360"));
  if (has_true(choices, "turntable") != choices.contains("views"))
    return tl::unexpected(invalid("a turntable needs \"views\", and nothing else does"));
  if (has_true(choices, "colour") && !has_true(choices, "turntable"))
    return tl::unexpected(
        invalid("\"colour\" needs a turntable: the object must stand still for its frame in white light"));
  if (has_true(choices, "turntable") && has_true(choices, "until_closed"))
    return tl::unexpected(invalid("a turntable ends after its views"));
  return choices;
}

/// The part of a report that the page shows; not the place of each cloud.
json brief_report(json report) {
  report["fused"] = report["fused"].is_array() ? report["fused"].size() : 0;
  return report;
}

/// The last sentence of the program, without its own name before it.
std::string without_name(std::string words) {
  while (!words.empty() && words.back() == '\n') words.pop_back();
  const std::size_t line = words.rfind('\n');
  if (line != std::string::npos) words.erase(0, line + 1);
  constexpr std::string_view kName = "slsd-model: ";
  return words.starts_with(kName) ? words.substr(kName.size()) : words;
}

std::string reason_of(const ModelProgram::End& end) {
  if (end.signal == SIGKILL)
    return "slsd-model was killed, probably because memory ran out: leave out the background, or build again with "
           "larger voxels. Its clouds are kept";
  if (end.signal != 0) return "slsd-model ended by signal " + std::to_string(end.signal) + ". Its clouds are kept";
  const std::string words = without_name(end.last_words);
  return words.empty() ? "slsd-model ended early and gave no reason" : words;
}

/// Maps a file: what is sent is not held in memory.
tl::expected<client::Bytes, Refusal> map_file(const path& file) {
  const FileDescriptor opened(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat about {};
  if (!opened || ::fstat(opened.number(), &about) != 0 || !S_ISREG(about.st_mode) || about.st_size == 0)
    return tl::unexpected(Refusal{404, "not_found", "there is no such file of the model yet"});
  const auto size = static_cast<std::size_t>(about.st_size);
  void* const memory = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, opened.number(), 0);
  if (memory == MAP_FAILED)
    return tl::unexpected(failed({ErrorCode::kIo, std::generic_category().message(errno), file.string()}));
  // Shared: each browser reads it at its own pace.
  const std::shared_ptr<const void> held(memory,
                                         [size](const void* mapped) { ::munmap(const_cast<void*>(mapped), size); });
  return client::Bytes(held, {static_cast<const char*>(memory), size});
}

}  // namespace

ModelSession::ModelSession(path folder, path socket)
    : folder_(std::move(folder)), socket_(std::move(socket)), made_in_(folder_) {
  const auto kept = read_file(folder_ / "session.json", kSessionBytesMax);
  const json session = kept ? json::parse(*kept, nullptr, /*allow_exceptions=*/false) : json();
  if (session.is_object() && (session.value("state", json()) == "done" || session.value("state", json()) == "failed")) {
    state_ = session["state"];
    choices_ = session.value("choices", json::object());
    report_ = session.value("report", json());
    error_ = session.value("error", json());
    progress_ = session.value("progress", json());
  } else if (kept_clouds() > 0) {
    state_ = "cut";
  }
  std::error_code ignored;
  std::filesystem::remove_all(folder_ / kNewFolder, ignored);
  if (std::filesystem::exists(folder_ / "preview.ply", ignored)) previews_ = 1;
}

bool ModelSession::runs() const {
  return state_ == kFollowing || state_ == kBuilding;
}

std::size_t ModelSession::kept_clouds() const {
  std::error_code error;
  std::size_t count = 0;
  for (std::filesystem::directory_iterator at(folder_ / "recording/clouds", error), end; !error && at != end;
       at.increment(error))
    ++count;
  return count;
}

json ModelSession::state() const {
  json formats = json::object();
  for (const std::string_view format : kModelFormats) {
    std::error_code error;
    const auto bytes = std::filesystem::file_size(folder_ / ("model." + std::string(format)), error);
    if (!error) formats[std::string(format)] = bytes;
  }
  std::error_code ignored;
  const bool background = std::filesystem::exists(folder_ / "background.ply", ignored);
  const std::lock_guard lock(mutex_);
  return {{"state", state_},
          {"installed", ModelProgram::is_installed()},
          {"choices", choices_},
          {"progress", progress_},
          {"building", building_},
          {"messages", messages_},
          {"report", report_},
          {"error", error_},
          {"formats", report_.is_object() ? std::move(formats) : json::object()},
          {"previews", previews_},
          {"has_background", background},
          {"kept_clouds", kept_clouds()}};
}

tl::expected<json, Refusal> ModelSession::act(const json& body) {
  const std::lock_guard acting(acting_);
  if (ended_) return tl::unexpected(not_now("slsd-web is ending"));
  const json action = body.value("action", json());
  std::optional<Refusal> refused;
  if (action == "start" || action == "build") {
    const auto choices = choices_of(body, action == "start");
    if (!choices) return tl::unexpected(choices.error());
    refused = action == "start" ? start(*choices) : build(*choices);
  } else if (action == "stop") {
    refused = stop();
  } else if (action == "next") {
    refused = next();
  } else if (action == "clear") {
    clear();
  } else if (action == "forget_background") {
    std::error_code ignored;
    std::filesystem::remove(folder_ / "background.ply", ignored);
  } else {
    refused = invalid(R"("action" must be "start", "next", "stop", "build", "clear" or "forget_background")");
  }
  if (refused) return tl::unexpected(std::move(*refused));
  return state();
}

std::optional<Refusal> ModelSession::start(const json& choices) {
  {
    const std::lock_guard lock(mutex_);
    if (runs()) return Refusal{503, "busy", "a model is being made: stop it first"};
  }
  if (auto refused = check_background(choices)) return refused;
  if (ModelProgram::is_installed()) clear();  // else the error says so
  std::vector<std::string> arguments{"--socket=" + socket_.string(), "--keep=" + (folder_ / "recording").string()};
  if (has_true(choices, "until_closed")) arguments.emplace_back("--until-closed");
  if (has_true(choices, "turntable"))
    arguments.insert(arguments.end(), {"--turntable", "--views=" + choices["views"].dump()});
  if (has_true(choices, "colour")) arguments.emplace_back("--colour");
  return run(std::move(arguments), choices, kFollowing);
}

std::optional<Refusal> ModelSession::build(const json& choices) {
  {
    const std::lock_guard lock(mutex_);
    if (runs()) return Refusal{503, "busy", "a model is being made: stop it first"};
  }
  if (kept_clouds() == 0) return not_now("there are no clouds to build a model from: start a session");
  if (auto refused = check_background(choices)) return refused;
  return run({"--from=" + (folder_ / "recording").string()}, choices, kBuilding);
}

std::optional<Refusal> ModelSession::check_background(const json& choices) const {
  std::error_code ignored;
  if (!has_true(choices, "use_background") || std::filesystem::exists(folder_ / "background.ply", ignored))
    return std::nullopt;
  return not_now("there is no cloud of the empty scene: take one, or do not leave the background out");
}

std::optional<Refusal> ModelSession::run(std::vector<std::string> arguments, const json& choices, const char* state) {
  program_.reset();
  bool keeps_model = false;
  {
    const std::lock_guard lock(mutex_);
    keeps_model = report_.is_object();
  }
  const path into = keeps_model ? folder_ / kNewFolder : folder_;
  std::error_code ignored;
  std::filesystem::remove_all(folder_ / kNewFolder, ignored);
  if (auto made = make_folder(into); !made) return failed(made.error());
  if (has_true(choices, "use_background")) arguments.push_back("--background=" + (folder_ / "background.ply").string());
  for (const std::string_view format : kModelFormats)
    arguments.push_back("--output=" + (into / ("model." + std::string(format))).string());
  arguments.insert(arguments.end(), {"--progress", "--preview=" + (into / "preview.ply").string()});
  if (has_true(choices, "close")) arguments.emplace_back("--close");
  if (choices.contains("voxel_mm")) arguments.push_back("--voxel=" + choices["voxel_mm"].dump());
  if (choices.contains("box")) {
    arguments.emplace_back("--box");
    for (const json& each : choices["box"]) arguments.push_back(each.dump());
  }
  std::string state_before;
  {
    const std::lock_guard lock(mutex_);
    state_before = std::exchange(state_, state);
    choices_ = choices;
    progress_before_ = std::exchange(progress_, nullptr);
    building_ = new_report_ = error_ = nullptr;
    made_in_ = into;
    messages_.clear();
    asked_views_ = 0;
    abandoned_ = false;
  }
  if (!keeps_model) std::filesystem::remove(folder_ / "session.json", ignored);
  auto started = ModelProgram::start(
      arguments, [this](const json& line) { note(line); }, [this](const ModelProgram::End& end) { note_end(end); });
  if (started) {
    program_ = std::move(*started);
    return std::nullopt;
  }
  const std::lock_guard lock(mutex_);
  made_in_ = folder_;
  progress_ = progress_before_;
  state_ = keeps_model ? state_before : kept_clouds() > 0 ? "cut" : "none";
  return failed(started.error());
}

std::optional<Refusal> ModelSession::stop() {
  const std::lock_guard lock(mutex_);
  if (state_ != kFollowing) return not_now("no object is being followed");
  program_->interrupt();
  return std::nullopt;
}

std::optional<Refusal> ModelSession::next() {
  const std::lock_guard lock(mutex_);
  if (state_ != kFollowing || !has_true(choices_, "turntable")) return not_now("no turntable is being followed");
  const std::size_t scanned = progress_.is_object() ? progress_.value("clouds", std::size_t{0}) : 0;
  if (asked_views_ > scanned) return not_now("a view is being scanned: wait until it is placed");
  ++asked_views_;
  program_->press_enter();
  return std::nullopt;
}

/// Ends the program without a model, and deletes what it made.
void ModelSession::clear() {
  {
    const std::lock_guard lock(mutex_);
    abandoned_ = true;
  }
  program_.reset();
  forget();
  const std::lock_guard lock(mutex_);
  state_ = "none";
  progress_ = building_ = report_ = error_ = nullptr;
  made_in_ = folder_;
  messages_.clear();
  previews_ = 0;
}

/// Deletes clouds and files, but not the background.
void ModelSession::forget() {
  std::error_code ignored;
  for (const char* const name : {"recording", kNewFolder}) std::filesystem::remove_all(folder_ / name, ignored);
  for (const char* const name : {"session.json", "preview.ply"}) std::filesystem::remove(folder_ / name, ignored);
  for (const std::string_view format : kModelFormats)
    std::filesystem::remove(folder_ / ("model." + std::string(format)), ignored);
}

void ModelSession::end() {
  const std::lock_guard acting(acting_);
  ended_ = true;
  {
    const std::lock_guard lock(mutex_);
    abandoned_ = true;
  }
  program_.reset();
}

void ModelSession::note(const json& line) {
  const std::lock_guard lock(mutex_);
  const auto told_of_preview = [this](const json& told) {
    const json before = progress_.is_object() ? progress_.value("previewed", json(0)) : json(0);
    if (told.value("previewed", json(0)) != before) ++previews_;
  };
  if (line.contains("message") && line["message"].is_string()) {
    messages_.push_back(line["message"]);
    if (messages_.size() > kMessagesMax) messages_.pop_front();
  } else if (line.contains("progress") && line["progress"].is_object()) {
    told_of_preview(line["progress"]);
    progress_ = line["progress"];
  } else if (line.contains("building") && line["building"].is_object()) {
    told_of_preview(line["building"]);
    if (progress_.is_object()) progress_["previewed"] = line["building"].value("previewed", json(0));
    state_ = kBuilding;
    building_ = line["building"];
  } else if (line.contains("report") && line["report"].is_object()) {
    ++previews_;
    new_report_ = brief_report(line["report"]);
  } else if (line.contains("error")) {
    error_ = line["error"];
  }
}

void ModelSession::note_end(const ModelProgram::End& end) {
  const std::lock_guard lock(mutex_);
  if (abandoned_) return;
  bool done = new_report_.is_object();
  building_ = nullptr;
  if (!done && error_.is_null()) error_ = {{"name", "error"}, {"message", reason_of(end)}};
  if (made_in_ != folder_) {
    if (const auto ended = end_rebuild(done); !ended) {
      done = false;
      report_ = nullptr;  // the files may be of two models
      error_ = {{"name", to_string(ended.error().code)}, {"message", to_string(ended.error())}};
    }
  }
  state_ = done ? "done" : "failed";
  if (done) report_ = new_report_;
  const json session{
      {"state", state_}, {"choices", choices_}, {"report", report_}, {"error", error_}, {"progress", progress_}};
  if (const auto kept = write_file_atomically(folder_ / "session.json", session.dump()); !kept)
    messages_.push_back("this model is not shown again when slsd-web restarts: " + to_string(kept.error()));
}

/// Puts the new model in the place of the one before, or shows the latter again.
/// @errors kIo: a file cannot be moved
Result<> ModelSession::end_rebuild(bool done) {
  std::error_code ignored;
  Result<> moved;
  const auto move = [&](const std::string& name) {
    std::error_code wrong;
    std::filesystem::rename(made_in_ / name, folder_ / name, wrong);
    if (wrong && moved)
      moved = fail(ErrorCode::kIo, "cannot replace the previous model: " + wrong.message() + "; build again",
                   (folder_ / name).string());
  };
  if (done) {
    std::filesystem::remove(folder_ / "session.json", ignored);  // first: cut amid this, the files are of two models
    move("preview.ply");
    for (const std::string_view format : kModelFormats) move("model." + std::string(format));
  } else {
    progress_ = progress_before_;
    ++previews_;
  }
  std::filesystem::remove_all(made_in_, ignored);
  made_in_ = folder_;
  return moved;
}

std::optional<Refusal> ModelSession::keep_background(std::string_view ply) {
  Result<> kept = make_folder(folder_);
  if (kept) kept = write_file_atomically(folder_ / "background.ply", ply);
  if (!kept) return failed(kept.error());
  return std::nullopt;
}

tl::expected<client::Bytes, Refusal> ModelSession::preview() const {
  const std::lock_guard lock(mutex_);
  auto growing = map_file(made_in_ / "preview.ply");
  return growing || made_in_ == folder_ ? std::move(growing) : map_file(folder_ / "preview.ply");
}

tl::expected<client::Bytes, Refusal> ModelSession::file(std::string_view format) const {
  if (std::ranges::find(kModelFormats, format) == kModelFormats.end())
    return tl::unexpected(invalid("\"format\" must be ply, stl, obj, glb or 3mf"));
  {
    const std::lock_guard lock(mutex_);
    if (!report_.is_object()) return tl::unexpected(Refusal{404, "not_found", "there is no model yet"});
  }
  return map_file(folder_ / ("model." + std::string(format)));
}

}  // namespace slsd::web
