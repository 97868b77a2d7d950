// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "slsd/cloud.hpp"

#include <algorithm>
#include <charconv>
#include <iterator>

#include <nlohmann/json.hpp>

#include "slsd/errors.hpp"

namespace slsd::client {
namespace {

constexpr std::size_t kHeaderMax = 1 << 16;
constexpr std::string_view kEnd = "end_header\n";

struct Type {
  std::string_view name;
  std::size_t size;
  char kind;
};
constexpr Type kTypes[] = {{"char", 1, 'i'}, {"uchar", 1, 'u'}, {"short", 2, 'i'}, {"ushort", 2, 'u'},
                           {"int", 4, 'i'},  {"uint", 4, 'u'},  {"float", 4, 'f'}, {"double", 8, 'f'}};

[[noreturn]] void lies(const std::string& how) {
  throw ProtocolError("the cloud " + how, "malformed");
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  while (true) {
    const std::size_t space = line.find(' ');
    words.push_back(line.substr(0, space));
    if (space == std::string_view::npos) return words;
    line.remove_prefix(space + 1);
  }
}

std::optional<std::uint64_t> number_in(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return value;
}

}  // namespace

const Field* Cloud::find(std::string_view name) const {
  const auto found =
      std::find_if(fields_.begin(), fields_.end(), [&](const Field& field) { return field.name == name; });
  return found == fields_.end() ? nullptr : &*found;
}

Cloud Cloud::read_ply(Bytes ply, std::string told) {
  const std::string_view whole = ply.view();
  const std::size_t end = whole.substr(0, kHeaderMax).find(kEnd);
  if (whole.rfind("ply\nformat binary_little_endian 1.0\n", 0) != 0 || end == std::string_view::npos) {
    lies("is not a binary little-endian PLY");
  }
  Cloud cloud;
  std::optional<std::uint64_t> count;
  std::string_view left = whole.substr(0, end);
  while (!left.empty()) {
    const std::string_view line = left.substr(0, left.find('\n'));
    left.remove_prefix(std::min(left.size(), line.size() + 1));
    const auto words = words_of(line);
    const auto type = std::find_if(std::begin(kTypes), std::end(kTypes),
                                   [&](const Type& known) { return words.size() == 3 && known.name == words[1]; });
    if (words[0] == "comment" && words.size() > 1) {
      const std::size_t value = sizeof "comment " + words[1].size();
      cloud.comments_[std::string(words[1])] = value < line.size() ? line.substr(value) : std::string_view();
    } else if (words[0] == "element" && words.size() == 3 && words[1] == "vertex" && number_in(words[2]) && !count) {
      count = number_in(words[2]);
    } else if (words[0] == "property" && type != std::end(kTypes) && !cloud.has(words[2])) {
      cloud.fields_.push_back({std::string(words[2]), cloud.record_bytes_, type->size, type->kind});
      cloud.record_bytes_ += type->size;
    } else if (words[0] == "element" || words[0] == "property") {
      lies("has an unknown line in its header: " + std::string(line.substr(0, 80)));
    }
  }
  const auto offset = [&](std::string_view name, std::size_t size, char kind) -> std::optional<std::size_t> {
    const Field* field = cloud.find(name);
    if (!field || field->size != size || field->kind != kind) return std::nullopt;
    return field->offset;
  };
  const auto x = offset("x", 4, 'f'), y = offset("y", 4, 'f'), z = offset("z", 4, 'f');
  if (!count || !x || !y || !z) lies("has a header without points");
  const std::string_view body = whole.substr(end + kEnd.size());
  if (*count != body.size() / cloud.record_bytes_ || body.size() % cloud.record_bytes_ != 0) {
    lies("has " + std::to_string(body.size()) + " bytes, but its header says " + std::to_string(*count) +
         " points of " + std::to_string(cloud.record_bytes_));
  }
  cloud.x_ = *x, cloud.y_ = *y, cloud.z_ = *z;
  cloud.sigma_mm_ = offset("sigma_mm", 4, 'f');
  cloud.intensity_ = offset("intensity", 1, 'u');
  cloud.camera_ = offset("camera", 1, 'u');
  cloud.records_ = body.data();
  cloud.size_ = *count;
  cloud.bytes_ = std::move(ply);
  const auto about = nlohmann::json::parse(told, nullptr, /*allow_exceptions=*/false);
  const auto of_type = [&](const char* key, auto is) {
    return about.is_object() && about.contains(key) && is(about[key]);
  };
  const auto is_number = [](const nlohmann::json& value) { return value.is_number(); };
  const auto is_count = [](const nlohmann::json& value) { return value.is_number_unsigned(); };
  const auto is_text = [](const nlohmann::json& value) { return value.is_string(); };
  if (of_type("scan", is_text)) cloud.scan = about["scan"];
  if (of_type("empty", is_text)) cloud.why_empty = about["empty"];
  if (of_type("lost", is_count)) cloud.lost = about["lost"];
  if (of_type("sigma_calibration_mm", is_number)) cloud.sigma_calibration_mm = about["sigma_calibration_mm"];
  if (of_type("received_monotonic_us", is_count)) {
    cloud.received = std::chrono::steady_clock::time_point(
        std::chrono::microseconds(about["received_monotonic_us"].get<std::int64_t>()));
  }
  cloud.description = std::move(told);
  return cloud;
}

}  // namespace slsd::client
