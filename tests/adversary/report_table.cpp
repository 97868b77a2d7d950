// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/adversary/report_table.hpp"

#include <cstdio>

#include "tests/adversary/scenes/scene_kinds.hpp"

namespace slsd::adversary {
namespace {

void write_pgm(const Grey8& image, const std::string& path) {
  std::FILE* const file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) return;
  std::fprintf(file, "P5\n%d %d\n255\n", image.width(), image.height());
  std::fwrite(image.data(), 1, image.size(), file);
  std::fclose(file);
}

}  // namespace

void Row::add(const Row& other) {
  frames += other.frames, frames_wrong += other.frames_wrong, wrong += other.wrong;
  undecidable += other.undecidable, right += other.right, decoded += other.decoded, visible += other.visible;
  if (other.in_the_air) in_the_air = in_the_air.value_or(0) + *other.in_the_air;
}

std::vector<Kind> drawn_grid_kinds(const ReportOptions& options) {
  std::vector<Kind> drawn;
  for (int kind = 0; kind < kKinds && !options.kept_out; ++kind)
    if (options.only_kind < 0 || options.only_kind == kind) drawn.push_back(static_cast<Kind>(kind));
  return drawn;
}

std::vector<int> drawn_scene_kinds(const ReportOptions& options) {
  std::vector<int> drawn;
  for (int index = 0; index < static_cast<int>(scene_kinds().size()); ++index) {
    if (scene_kinds()[static_cast<std::size_t>(index)].kept_out != options.kept_out) continue;
    if (options.only_kind < 0 || options.only_kind == number_of_scene_kind(index)) drawn.push_back(index);
  }
  return drawn;
}

void print_heading() {
  std::puts(
      "| frames of | number | wrong points | frames with one | in the air | undecidable | right points | of the "
      "visible % |\n|---|---|---|---|---|---|---|---|");
}

void print(std::string_view name, const Row& row) {
  const std::string in_the_air = row.in_the_air ? std::to_string(*row.in_the_air) : "";
  std::printf("| %s | %d | %d | %d | %s | %d | %d | %.1f |\n", std::string(name).c_str(), row.frames, row.wrong,
              row.frames_wrong, in_the_air.c_str(), row.undecidable, row.right,
              row.visible == 0 ? 0. : 100. * row.decoded / row.visible);
}

void tell(const ReportOptions& options, int kind, int number, const Grey8& image, const Decoding& decoding,
          const std::vector<CloudPoint>& wrong_points) {
  for (const CloudPoint& point : wrong_points) {
    const auto symbol = std::ranges::find_if(decoding.regions, [&](const RegionSeen& region) {
      return region.row == point.row && region.column == point.column;
    });
    std::fprintf(stderr, "wrong: --kind %d --frame %d: row %d, column %d at (%.1f, %.1f) px, %s by %.1f nats\n", kind,
                 number, point.row, point.column, point.camera_u, point.camera_v,
                 std::string(to_string(symbol->rule)).c_str(), symbol->margin_nats);
  }
  if (options.picture != nullptr) write_pgm(image, options.picture);
  if (!options.single) return;
  for (int i = 0; i < kRegionStatusCount; ++i)
    std::fprintf(stderr, "%s %u\n", std::string(to_string(static_cast<RegionStatus>(i))).c_str(), decoding.counts[i]);
  for (std::size_t i = 0; i < kDecodeRuleCount; ++i)
    if (decoding.rules[i] > 0)
      std::fprintf(stderr, "  by %s %u\n", std::string(to_string(decode_rule(i))).c_str(), decoding.rules[i]);
}

}  // namespace slsd::adversary
