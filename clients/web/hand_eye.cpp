// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/web/hand_eye.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <system_error>
#include <utility>

#include "clients/usage/hand_eye_usage.hpp"
#include "clients/web/away.hpp"
#include "clients/web/view_folder.hpp"
#include "core/geometry/robot_pose.hpp"
#include "core/result.hpp"
#include "drivers/files/file.hpp"
#include "drivers/system/file_descriptor.hpp"
#include "drivers/system/own_program.hpp"
#include "rpc/message.hpp"

namespace slsd::web {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using nlohmann::json;
using std::filesystem::path;

constexpr auto kProgramEnds = 5min;
constexpr std::size_t kOutputBytesMax = 16 << 20;
constexpr std::size_t kChoicesBytesMax = 1 << 16;
constexpr std::size_t kTextMax = 200;

const std::array<const char*, 2> kMountings = {"arm", "cell"};

Refusal wrong(std::string message) {
  return {400, "invalid_params", std::move(message)};
}

Refusal broken(const Error& error) {
  return {502, std::string(to_string(error.code)), to_string(error)};
}

std::string text_in(const json& body, const char* key) {
  const auto found = body.find(key);
  return found != body.end() && found->is_string() ? found->get<std::string>() : "";
}

/// @return nothing, if these are no numbers
std::optional<std::vector<double>> numbers_in(const json& body, const char* key) {
  const auto found = body.find(key);
  std::vector<double> numbers;
  if (found == body.end() || !found->is_array()) return std::nullopt;
  for (const json& each : *found) {
    if (!each.is_number()) return std::nullopt;
    numbers.push_back(each.get<double>());
  }
  return numbers;
}

std::string joined(const std::vector<double>& numbers) {
  std::string text;
  for (const double number : numbers) text += (text.empty() ? "" : ",") + json(number).dump();
  return text;
}

/// @return why a text cannot be passed on as an option's value; empty: it can
std::string fault_of_text(const json& body, const char* key) {
  if (!body.contains(key)) return "";
  const std::string text = text_in(body, key);
  const bool plain = std::ranges::all_of(text, [](unsigned char letter) { return letter >= ' ' && letter < 0x7f; });
  return body[key].is_string() && plain && text.size() <= kTextMax ? ""
                                                                   : std::string(key) + " must be short ASCII text";
}

/// @return why these cannot be the user's choices; empty: they can
std::string fault_of(const json& choices) {
  if (std::ranges::find(kMountings, text_in(choices, "mounted")) == kMountings.end())
    return "\"mounted\" must be \"arm\" or \"cell\"";
  if (const auto notation = pose_notation(text_in(choices, "poses")); !notation) return to_string(notation.error());
  for (const char* key : {"board", "ruler"}) {
    if (auto fault = fault_of_text(choices, key); !fault.empty()) return fault;
  }
  if (choices.contains("ruler") && !choices.contains("board")) return "a ruler needs its board";
  if (choices.contains("distance_mm") && !choices["distance_mm"].is_number()) return "distance_mm must be a number";
  const auto measured = numbers_in(choices, "measured_mm");
  if (choices.contains("measured_mm") && (!measured || measured->size() != 3))
    return "measured_mm must be three numbers";
  return "";
}

/// The options of slsctl hand-eye for these choices.
std::vector<std::string> arguments_of(const json& choices, const path& folder, const path& socket) {
  std::vector<std::string> arguments{"--json",
                                     "--socket=" + socket.string(),
                                     "hand-eye",
                                     "--service",
                                     "--looks",
                                     "--from=" + folder.string(),
                                     "--mounted=" + text_in(choices, "mounted"),
                                     "--poses=" + text_in(choices, "poses")};
  for (const char* key : {"board", "ruler"}) {
    if (choices.contains(key)) arguments.push_back("--" + std::string(key) + "=" + text_in(choices, key));
  }
  if (choices.contains("distance_mm")) arguments.push_back("--distance-mm=" + choices["distance_mm"].dump());
  if (const auto measured = numbers_in(choices, "measured_mm")) arguments.push_back("--measured=" + joined(*measured));
  return arguments;
}

struct Ended {
  int status = 0;  ///< -1: by a signal
  std::vector<json> told;
};

/// Reads lines of JSON until the other end closes.
/// @errors kTimeout, kIo
Result<std::vector<json>> read_lines(int descriptor) {
  const auto end = Clock::now() + kProgramEnds;
  std::string text;
  std::array<char, 65536> chunk{};
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
    pollfd waited{descriptor, POLLIN, 0};
    const int ready = left <= 0ms ? 0 : ::poll(&waited, 1, static_cast<int>(left.count()));
    if (ready < 0 && errno == EINTR) continue;
    if (ready == 0) return fail(ErrorCode::kTimeout, "did not end: use fewer views", kHandEyeProgram);
    const ssize_t count = ::read(descriptor, chunk.data(), chunk.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return fail(ErrorCode::kIo, std::generic_category().message(errno), kHandEyeProgram);
    if (count == 0) break;
    if (text.size() < kOutputBytesMax) text.append(chunk.data(), static_cast<std::size_t>(count));
  }
  std::vector<json> told;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t stop = std::min(text.find('\n', at), text.size());
    json line = json::parse(text.substr(at, stop - at), nullptr, /*allow_exceptions=*/false);
    if (line.is_object()) told.push_back(std::move(line));
    at = stop + 1;
  }
  return told;
}

Result<Ended> run_program(const std::vector<std::string>& arguments) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return fail(ErrorCode::kIo, "no pipe: " + std::generic_category().message(errno));
  const FileDescriptor reading(ends[0]);
  FileDescriptor writing(ends[1]);
  auto process = start_own_program(find_own_program(kHandEyeProgram), arguments, {-1, writing.number(), STDERR_FILENO});
  static_cast<void>(writing.close());
  if (!process) {
    if (process.error().code == ErrorCode::kNotFound)
      process.error().message = "the program that calibrates is not installed: install the package slsd-calibrate";
    return tl::unexpected(std::move(process.error()));
  }
  auto told = read_lines(reading.number());
  if (!told) ::kill(*process, SIGKILL);
  int status = 0;
  while (::waitpid(*process, &status, 0) < 0 && errno == EINTR) continue;
  if (!told) return tl::unexpected(std::move(told.error()));
  return Ended{WIFEXITED(status) ? WEXITSTATUS(status) : -1, std::move(*told)};
}

/// The program's error as the page shows it: with the ends of its lines.
json error_of(const json& told, const path& socket) {
  if (is_away(told.value("/data/name"_json_pointer, ""), told.value("/data/where"_json_pointer, ""), socket)) {
    const Refusal away = no_service(socket);
    return {{"name", away.name}, {"message", away.message}};
  }
  std::string message = told.value("message", "it gave no reason");
  for (std::size_t at = 0; (at = message.find("\\n", at)) != std::string::npos;) message.replace(at, 2, "\n");
  return {{"name", told.value("/data/name"_json_pointer, "error")}, {"message", std::move(message)}};
}

}  // namespace

HandEye::HandEye(path folder, path socket) : folder_(std::move(folder)), socket_(std::move(socket)) {
  choices_ = {{"mounted", kMountings.front()}, {"poses", pose_notation_names().front()}};
  const auto kept = read_file(folder_ / "choices.json", kChoicesBytesMax);
  const json choices = kept ? json::parse(*kept, nullptr, /*allow_exceptions=*/false) : json();
  if (choices.is_object() && fault_of(choices).empty()) choices_ = choices;
}

json HandEye::state() const {
  const std::lock_guard lock(mutex_);
  json views = json::array();
  for (const KeptView& kept : views_in(folder_)) {
    json view{{"name", kept.name}, {"pose", kept.pose}};
    if (const auto seen = seen_.find(kept.name); seen != seen_.end()) {
      view.update(seen->second);
      view.erase("cameras");  // their points are for the picture
    }
    views.push_back(std::move(view));
  }
  std::error_code ignored;
  return {{"choices", choices_}, {"looks", std::move(views)},
          {"outcome", outcome_}, {"error", error_},
          {"busy", busy_},       {"has_file", std::filesystem::exists(file(), ignored)}};
}

tl::expected<json, Refusal> HandEye::act(const json& body) {
  const std::unique_lock acting(acting_, std::try_to_lock);
  if (!acting)
    return tl::unexpected(Refusal{503, "busy", "a view is being taken or evaluated: wait until that is done"});
  {
    const std::lock_guard lock(mutex_);
    busy_ = true;
    error_ = nullptr;
  }
  auto refused = carry_out(body);
  {
    const std::lock_guard lock(mutex_);
    busy_ = false;
  }
  if (refused) return tl::unexpected(std::move(*refused));
  return state();
}

std::optional<Refusal> HandEye::carry_out(const json& body) {
  const std::string action = text_in(body, "action");
  if (action == "drop") return drop(body.value("look", json()));
  if (action == "clear") return clear();
  if (action != "take" && action != "calculate")
    return wrong("\"action\" must be \"take\", \"calculate\", \"drop\" or \"clear\"");
  if (auto refused = choose(body)) return refused;
  return action == "take" ? take(body.value("pose", json())) : calculate();
}

std::optional<Refusal> HandEye::choose(const json& body) {
  if (auto refused = unknown_parameter(
          body, {"mounted", "poses", "board", "ruler", "distance_mm", "measured_mm", "action", "pose", "look"}))
    return refused;
  json choices = body;
  for (const char* other : {"action", "pose", "look"}) choices.erase(other);
  if (const std::string fault = fault_of(choices); !fault.empty()) return wrong(fault);
  if (auto made = make_folder(folder_); !made) return broken(made.error());
  if (auto kept = write_file_atomically(folder_ / "choices.json", choices.dump()); !kept) return broken(kept.error());
  const std::lock_guard lock(mutex_);
  choices_ = std::move(choices);
  return std::nullopt;
}

std::optional<Refusal> HandEye::take(const json& pose) {
  const auto numbers = numbers_in({{"pose", pose}}, "pose");
  if (!numbers) return wrong("\"pose\" must be the robot's numbers");
  const auto notation = pose_notation(text_in(choices_, "poses"));
  if (const auto read = read_robot_pose(*numbers, *notation); !read) return wrong("the pose " + read.error().message);
  return run(joined(*numbers));
}

std::optional<Refusal> HandEye::drop(const json& view) {
  const std::string name = view.is_string() ? view.get<std::string>() : "";
  if (const auto erased = erase_view(folder_, name); !erased) {
    if (erased.error().code == ErrorCode::kNotFound) return Refusal{404, "not_found", to_string(erased.error())};
    return broken(erased.error());
  }
  {
    const std::lock_guard lock(mutex_);
    seen_.erase(name);
  }
  return calculate();
}

std::optional<Refusal> HandEye::clear() {
  remove_result();
  for (const KeptView& view : views_in(folder_)) {
    if (const auto erased = erase_view(folder_, view.name); !erased) return broken(erased.error());
  }
  const std::lock_guard lock(mutex_);
  seen_.clear();
  return std::nullopt;
}

std::optional<Refusal> HandEye::calculate() {
  remove_result();  // it belongs to other views or choices
  return views_in(folder_).empty() ? std::nullopt : run("");
}

/// @param pose  of a view to take first; empty: none
std::optional<Refusal> HandEye::run(const std::string& pose) {
  std::vector<std::string> arguments = arguments_of(choices_, folder_, socket_);
  if (!pose.empty()) arguments.push_back("--pose=" + pose);
  const auto ended = run_program(arguments);
  if (!ended) return broken(ended.error());
  note(ended->told);
  const std::lock_guard lock(mutex_);
  if (ended->status == 0) return std::nullopt;
  if (error_.is_null()) error_ = {{"name", "error"}, {"message", "the program ended early: see the log of slsd-web"}};
  const std::string name = error_["name"];
  if (name != "no_service" && name != "permission_denied") return std::nullopt;
  return Refusal{name == "no_service" ? 503 : 403, name, std::exchange(error_, nullptr)["message"]};
}

void HandEye::note(const std::vector<json>& told) {
  const std::lock_guard lock(mutex_);
  for (json line : told) {
    if (const std::string name = text_in(line, "look"); !name.empty()) {
      line.erase("look");
      seen_[name] = std::move(line);
    } else if (line.contains("error")) {
      error_ = error_of(line["error"], socket_);
    } else {
      outcome_ = std::move(line);
      std::error_code ignored;
      if (!outcome_.contains("file")) std::filesystem::remove(file(), ignored);
    }
  }
}

void HandEye::remove_result() {
  const std::lock_guard lock(mutex_);
  std::error_code ignored;
  std::filesystem::remove(file(), ignored);
  outcome_ = nullptr;
}

tl::expected<HandEye::Picture, Refusal> HandEye::picture(const std::string& view, std::string camera) const {
  const auto cameras = cameras_of_view(folder_, view);
  if (camera.empty() && !cameras.empty()) camera = cameras.front();
  auto png = picture_of_view(folder_, view, camera);
  if (!png) return tl::unexpected(Refusal{404, "not_found", to_string(png.error())});
  json about{{"look", view}, {"cameras", cameras}, {"camera", camera}, {"points_px", json::array()}};
  const std::lock_guard lock(mutex_);
  const auto seen = seen_.find(view);
  if (seen == seen_.end()) return Picture{std::move(*png), std::move(about)};
  for (const json& each : seen->second.value("cameras", json::array())) {
    if (camera.empty() || each.value("name", "") == camera) about["points_px"] = each["points_px"];
  }
  return Picture{std::move(*png), std::move(about)};
}

}  // namespace slsd::web
