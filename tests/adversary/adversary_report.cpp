// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "tests/adversary/misled.hpp"
#include "tests/adversary/rule_sweep.hpp"

namespace slsd::adversary {
namespace {

struct Row {
  int frames = 0, frames_wrong = 0, wrong = 0, undecidable = 0, right = 0, visible = 0;
};

void write_pgm(const Grey8& image, const std::string& path) {
  std::FILE* const file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) return;
  std::fprintf(file, "P5\n%d %d\n255\n", image.width(), image.height());
  std::fwrite(image.data(), 1, image.size(), file);
  std::fclose(file);
}

void print(const char* name, const Row& row) {
  std::printf("| %s | %d | %d | %d | %d | %d | %.1f |\n", name, row.frames, row.wrong, row.frames_wrong,
              row.undecidable, row.right, row.visible == 0 ? 0. : 100. * row.right / row.visible);
}

/// @param first  number of each kind's first frame: those of another number are other frames
/// @param trial  leaves rules out
Result<int> report(int frames, int first, int only_kind, bool single, const char* picture, RuleTrial& trial) {
  std::vector<Misled> readers;
  for (const int symbol_size_px : {16, 8}) {
    auto reader = Misled::of(symbol_size_px, &trial);
    if (!reader) return tl::unexpected(reader.error());
    readers.push_back(std::move(*reader));
  }
  Row all, slats;
  std::puts(
      "| frames of | number | wrong points | frames with one | undecidable | right points | of the visible % "
      "|\n|---|---|---|---|---|---|---|");
  for (int k = 0; k < kKinds; ++k) {
    if (only_kind >= 0 && k != only_kind) continue;
    const Kind kind = static_cast<Kind>(k);
    Row row;
    for (int n = first; n < first + (frames + kKinds - 1) / kKinds; ++n) {
      Misled& reader = readers[n % 2];
      const Frame frame = reader.maker.make(kind, static_cast<std::uint32_t>(n));
      const auto decoding = reader.decoders[n / 2 % 3].decode(frame.image.view(), 255);
      if (!decoding) return tl::unexpected(decoding.error());
      const Verdict verdict = reader.maker.judge(frame, (*decoding)->points, kTolerancePx);
      ++row.frames, row.frames_wrong += verdict.wrong > 0;
      row.wrong += verdict.wrong, row.undecidable += verdict.undecidable;
      row.right += verdict.right, row.visible += verdict.visible;
      for (const CloudPoint& point : verdict.wrong_points) {
        std::fprintf(stderr, "wrong: --kind %d --frame %d: row %d, column %d at (%.1f, %.1f) px\n", k, n, point.row,
                     point.column, point.camera_u, point.camera_v);
      }
      if (picture != nullptr) write_pgm(frame.image, picture);
      if (single) {
        for (int i = 0; i < kRegionStatusCount; ++i)
          std::fprintf(stderr, "%s %u\n", std::string(to_string(static_cast<RegionStatus>(i))).c_str(),
                       (*decoding)->counts[i]);
        for (std::size_t i = 0; i < kDecodeRuleCount; ++i)
          if ((*decoding)->rules[i] > 0)
            std::fprintf(stderr, "  by %s %u\n", std::string(to_string(decode_rule(i))).c_str(), (*decoding)->rules[i]);
      }
    }
    print(std::string(to_string(kind)).c_str(), row);
    for (Row* sum : {&all, k <= static_cast<int>(Kind::kPickets) ? &slats : nullptr}) {
      if (sum == nullptr) continue;
      sum->frames += row.frames, sum->frames_wrong += row.frames_wrong, sum->wrong += row.wrong;
      sum->undecidable += row.undecidable, sum->right += row.right, sum->visible += row.visible;
    }
  }
  if (only_kind < 0) print("slats, shelves and pickets", slats), print("all", all);
  return all.wrong;
}

}  // namespace
}  // namespace slsd::adversary

// adversary-report [FRAMES] [--first N] [--kind K] [--without RULE]... [--each-rule] [--frame N [--picture FILE.pgm]]
int main(int count, char** arguments) {
  int frames = 1000, first = 0, kind = -1, number = -1;
  const char* picture = nullptr;
  bool each_rule = false;
  slsd::RuleTrial trial;
  for (int i = 1; i < count; ++i) {
    const bool more = i + 1 < count;
    if (std::strcmp(arguments[i], "--kind") == 0 && more) {
      kind = std::atoi(arguments[++i]);
    } else if (std::strcmp(arguments[i], "--frame") == 0 && more) {
      number = std::atoi(arguments[++i]);
    } else if (std::strcmp(arguments[i], "--first") == 0 && more) {
      first = std::atoi(arguments[++i]);
    } else if (std::strcmp(arguments[i], "--without") == 0 && more) {
      const auto rule = slsd::adversary::rule_named(arguments[++i]);
      if (!rule) {
        std::fprintf(stderr, "adversary-report: %s\n", slsd::to_string(rule.error()).c_str());
        return 2;
      }
      trial.off.set(static_cast<std::size_t>(*rule));
    } else if (std::strcmp(arguments[i], "--each-rule") == 0) {
      each_rule = true;
    } else if (std::strcmp(arguments[i], "--picture") == 0 && more) {
      picture = arguments[++i];
    } else {
      frames = std::atoi(arguments[i]);
    }
  }
  if (number >= 0) first = number, frames = slsd::adversary::kKinds;
  const auto wrong = each_rule ? slsd::adversary::sweep_rules(frames, first, kind, trial.off)
                               : slsd::adversary::report(frames, first, kind, number >= 0, picture, trial);
  if (!wrong) std::fprintf(stderr, "adversary-report: %s\n", slsd::to_string(wrong.error()).c_str());
  return wrong && *wrong == 0 ? 0 : 1;
}
