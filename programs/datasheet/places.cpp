// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/datasheet/places.hpp"

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include "drivers/files/file.hpp"

namespace slsd {
namespace {

using nlohmann::json;
using std::filesystem::path;

constexpr std::size_t kCloudBytesMax = std::size_t{1} << 31;

std::optional<int> number_of(const std::string& name, const std::string& begin) {
  constexpr std::string_view kEnd = ".ply";
  if (!name.starts_with(begin) || !name.ends_with(kEnd)) return std::nullopt;
  int number = 0;
  const char* const last = name.data() + name.size() - kEnd.size();
  const auto [end, error] = std::from_chars(name.data() + begin.size(), last, number);
  if (error != std::errc() || end != last || number < 1) return std::nullopt;
  return number;
}

}  // namespace

std::string to_string(Artefact artefact) {
  return artefact == Artefact::kPlate ? "plate" : artefact == Artefact::kSphere ? "sphere" : "bar";
}

std::string cloud_name(Artefact artefact, int number) {
  return fmt::format("{}-{:02}.ply", to_string(artefact), number);
}

Result<std::map<int, path>> clouds_in(const path& folder, Artefact artefact) {
  std::error_code error;
  std::map<int, path> clouds;
  if (!std::filesystem::exists(folder, error)) return clouds;
  std::filesystem::directory_iterator entries(folder, error);
  for (; !error && entries != std::filesystem::directory_iterator(); entries.increment(error)) {
    if (const auto number = number_of(entries->path().filename().string(), to_string(artefact) + "-"))
      clouds[*number] = entries->path();
  }
  if (error) return fail(ErrorCode::kIo, error.message(), folder.string());
  return clouds;
}

Result<std::vector<DensePoint>> read_place(const path& file) {
  const auto bytes = read_file(file, kCloudBytesMax);
  if (!bytes) return tl::unexpected(bytes.error());
  auto points = read_dense_ply(*bytes);
  if (!points) return fail(points.error().code, points.error().message, file.string());
  return points;
}

Result<PlaceScanner> PlaceScanner::open(const path& socket) {
  auto connection = Connection::open(socket);
  if (!connection) return tl::unexpected(connection.error());
  return PlaceScanner(std::move(*connection));
}

Result<std::string> PlaceScanner::scan() {
  const auto answered =
      connection_.call("scan", {{"format", "ply"}, {"density", "pixels"}, {"coordinate_frame", "rig"}});
  if (!answered) return tl::unexpected(answered.error());
  const json& message = answered->reply.message;
  if (message.contains("error"))
    return fail(ErrorCode::kIo, message["error"].value("message", "the service refused the scan"));
  return std::string(answered->reply.bytes.view());
}

}  // namespace slsd
