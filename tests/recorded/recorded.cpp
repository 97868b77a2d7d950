// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/recorded/recorded.hpp"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <utility>

#include <fmt/format.h>

#include "core/decode/decoder.hpp"
#include "tests/adversary/misled.hpp"
#include "tests/corpus/score.hpp"

namespace slsd {

using adversary::Kind;

namespace {

constexpr int kFramesOfAKind = 6;  // two to each working depth
constexpr std::string_view kScenes[] = {"16px-5-bust",     "16px-5-cylinder",      "16px-5-plane_30", "16px-5-step",
                                        "16px-5-textured", "16px-5-falling_light", "8px-6-bust",      "8px-6-cylinder",
                                        "8px-6-plane_0",   "paper-1-bust",         "paper-2-bust"};

std::string line_of(std::string_view frame, const Decoding& decoding) {
  std::string line(frame);
  line += ':';
  for (int i = 0; i < kRegionStatusCount; ++i)
    if (decoding.counts[i] > 0)
      line += fmt::format(" {} {}", to_string(static_cast<RegionStatus>(i)), decoding.counts[i]);
  int links = 0, broken = 0;
  for (const RegionSeen& region : decoding.regions) {
    links += static_cast<int>(std::ranges::count_if(region.links, [](std::int32_t other) { return other >= 0; }));
    broken += static_cast<int>(std::ranges::count(region.broken, true));
  }
  std::uint32_t cells = 0;
  double depth_mm = 0, sigma_mm = 0, intensity = 0;
  for (const CloudPoint& point : decoding.points) {
    cells = (cells + point.row * 1009U + point.column * 31U) % 99991U;
    depth_mm += point.z, sigma_mm += point.sigma_mm, intensity += point.intensity;
  }
  line += fmt::format(" | links {} broken {} off line {}", links, broken, decoding.off_line.size());
  if (decoding.points.empty()) return line;
  const auto count = static_cast<double>(decoding.points.size());
  return line + fmt::format(" | points {} cells {} at {:.2f} mm sigma {:.4f} mm lit {:.1f}", count, cells,
                            depth_mm / count, sigma_mm / count, intensity / count);
}

Result<std::vector<std::string>> record_scene(const FrameGroup& group) {
  const auto scene = read_scene(group.scene);
  if (!scene) return tl::unexpected(scene.error());
  std::vector<std::string> lines;
  for (const auto& [way, options] :
       {std::pair("", DecodeOptions{}), {" fine", {.precision = Precision::kFine}}, {" paper", papers_way()}}) {
    auto decoder = Decoder::create(scene->pattern, scene->calibration, 0, options);
    if (!decoder) return tl::unexpected(decoder.error());
    const auto decoding = decoder->decode(view(scene->frame));
    if (!decoding) return tl::unexpected(decoding.error());
    lines.push_back(line_of(group.name() + way, **decoding));
  }
  return lines;
}

Result<std::vector<std::string>> record_misleading(const FrameGroup& group) {
  auto misled = adversary::Misled::of(group.symbol_size_px);
  if (!misled) return tl::unexpected(misled.error());
  std::vector<std::string> lines;
  for (int number = 0; number < kFramesOfAKind; ++number) {
    const adversary::Frame frame = misled->maker.make(group.kind, static_cast<std::uint32_t>(number));
    const auto decoding =
        misled->decoders[static_cast<std::size_t>(number) % misled->decoders.size()].decode(frame.image.view(), 255);
    if (!decoding) return tl::unexpected(decoding.error());
    lines.push_back(line_of(fmt::format("{} {}", group.name(), number), **decoding));
  }
  return lines;
}

}  // namespace

std::string FrameGroup::name() const {
  std::string name = scene.empty() ? fmt::format("{}px_{}", symbol_size_px, to_string(kind)) : std::string(scene);
  std::string plain;
  for (const char c : name) {
    const bool good = std::isalnum(static_cast<unsigned char>(c)) != 0;
    if (good) plain += c;
    if (!good && !plain.empty() && plain.back() != '_') plain += '_';
  }
  while (plain.back() == '_') plain.pop_back();
  return plain;
}

std::vector<FrameGroup> recorded_groups() {
  std::vector<FrameGroup> groups;
  for (const int symbol_size_px : {16, 8})
    for (int kind = 0; kind < adversary::kKinds; ++kind)
      groups.push_back({symbol_size_px, static_cast<Kind>(kind), {}});
  for (const std::string_view scene : kScenes) groups.push_back({0, {}, scene});
  return groups;
}

Result<std::vector<std::string>> record(const FrameGroup& group) {
  return group.scene.empty() ? record_misleading(group) : record_scene(group);
}

}  // namespace slsd
