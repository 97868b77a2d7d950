// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "tests/adversary/margin_table.hpp"
#include "tests/adversary/misled.hpp"
#include "tests/adversary/report_table.hpp"
#include "tests/adversary/rule_sweep.hpp"
#include "tests/adversary/scene_report.hpp"

namespace slsd::adversary {
namespace {

/// Decodes frames whose edges follow the pattern's grid, and prints a row for each kind.
/// @return all of them
Result<Row> report_grid(std::vector<Misled>& readers, const ReportOptions& options, MarginTable& margins) {
  Row all, slats;
  for (const Kind kind : drawn_grid_kinds(options)) {
    Row row;
    for (int n = options.first; n < options.first + options.frames_of_a_kind; ++n) {
      Misled& reader = readers[static_cast<std::size_t>(n) % readers.size()];
      const Frame frame = reader.maker.make(kind, static_cast<std::uint32_t>(n));
      const auto decoding =
          reader.decoders[static_cast<std::size_t>(n) / readers.size() % 3].decode(frame.image.view(), 255);
      if (!decoding) return tl::unexpected(decoding.error());
      const Verdict verdict = reader.maker.judge(frame, (*decoding)->points, kTolerancePx);
      row.add(
          {1, verdict.wrong > 0, verdict.wrong, verdict.undecidable, verdict.right, verdict.right, verdict.visible});
      margins.add(**decoding, verdict.wrong_points);
      tell(options, static_cast<int>(kind), n, frame.image, **decoding, verdict.wrong_points);
    }
    print(to_string(kind), row);
    all.add(row);
    if (kind <= Kind::kPickets) slats.add(row);
  }
  if (options.only_kind < 0 && !options.kept_out)
    print("slats, shelves and pickets", slats), print("all of the grid's kinds", all);
  return all;
}

Result<std::vector<Pattern>> shown_patterns(const ReportOptions& options) {
  std::vector<Pattern> patterns;
  const auto add = [&](Result<Pattern> pattern) -> Result<> {
    if (!pattern) return tl::unexpected(pattern.error());
    patterns.push_back(std::move(*pattern));
    return {};
  };
  for (const std::string& file : options.patterns) {
    std::ifstream stream(file, std::ios::binary);
    const std::string text(std::istreambuf_iterator<char>(stream), {});
    if (auto added = add(read_pattern(text, file)); !added) return tl::unexpected(added.error());
  }
  if (!patterns.empty()) return patterns;
  for (const int symbol_size_px : {16, 8})
    if (auto added = add(make_pattern({.symbol_size_px = symbol_size_px})); !added)
      return tl::unexpected(added.error());
  return patterns;
}

/// @param trial  leaves rules out
/// @return       wrong points
Result<int> report(const ReportOptions& options, RuleTrial& trial) {
  auto patterns = shown_patterns(options);
  if (!patterns) return tl::unexpected(patterns.error());
  std::vector<Misled> readers;
  for (const Pattern& pattern : *patterns) {
    auto reader = Misled::of(pattern, &trial, options.wrong_cells_max);
    if (!reader) return tl::unexpected(reader.error());
    readers.push_back(std::move(*reader));
  }
  MarginTable margins;
  print_heading();
  const auto grid = report_grid(readers, options, margins);
  if (!grid) return tl::unexpected(grid.error());
  const auto scenes = report_scenes(readers, options, margins);
  if (!scenes) return tl::unexpected(scenes.error());
  Row all = *grid;
  all.add(*scenes);
  if (options.only_kind < 0) print("all", all);
  if (options.margins) margins.print();
  return all.wrong;
}

}  // namespace
}  // namespace slsd::adversary

// adversary-report [FRAMES] [--kept-out] [--clean] [--first N] [--kind K] [--without RULE]... [--each-rule]
// [--wrong-cells MAX] [--margins] [--pattern FILE]... [--frame N [--picture FILE.pgm]]
int main(int count, char** arguments) {
  slsd::adversary::ReportOptions options;
  int frames = 1000, number = -1;
  bool each_rule = false;
  slsd::RuleTrial trial;
  for (int i = 1; i < count; ++i) {
    const bool more = i + 1 < count;
    if (std::strcmp(arguments[i], "--kind") == 0 && more) {
      options.only_kind = std::atoi(arguments[++i]);
    } else if (std::strcmp(arguments[i], "--frame") == 0 && more) {
      number = std::atoi(arguments[++i]);
    } else if (std::strcmp(arguments[i], "--first") == 0 && more) {
      options.first = std::atoi(arguments[++i]);
    } else if (std::strcmp(arguments[i], "--picture") == 0 && more) {
      options.picture = arguments[++i];
    } else if (std::strcmp(arguments[i], "--kept-out") == 0) {
      options.kept_out = true;
    } else if (std::strcmp(arguments[i], "--clean") == 0) {
      options.clean = true;
    } else if (std::strcmp(arguments[i], "--without") == 0 && more) {
      const auto rule = slsd::adversary::rule_named(arguments[++i]);
      if (!rule) {
        std::fprintf(stderr, "adversary-report: %s\n", slsd::to_string(rule.error()).c_str());
        return 2;
      }
      trial.off.set(static_cast<std::size_t>(*rule));
    } else if (std::strcmp(arguments[i], "--wrong-cells") == 0 && more) {
      options.wrong_cells_max = std::atof(arguments[++i]);
    } else if (std::strcmp(arguments[i], "--pattern") == 0 && more) {
      options.patterns.emplace_back(arguments[++i]);
    } else if (std::strcmp(arguments[i], "--margins") == 0) {
      options.margins = trial.whole_margins = true;
    } else if (std::strcmp(arguments[i], "--each-rule") == 0) {
      each_rule = true;
    } else {
      frames = std::atoi(arguments[i]);
    }
  }
  const auto kinds = static_cast<int>(slsd::adversary::drawn_grid_kinds(options).size() +
                                      slsd::adversary::drawn_scene_kinds(options).size());
  if (kinds == 0) {
    std::fputs("adversary-report: no such kind is drawn; those kept out of tuning need --kept-out\n", stderr);
    return 2;
  }
  options.frames_of_a_kind = (frames + kinds - 1) / kinds;
  if (number >= 0) options.first = number, options.frames_of_a_kind = 1, options.single = true;
  const auto wrong =
      each_rule ? slsd::adversary::sweep_rules(options, trial.off) : slsd::adversary::report(options, trial);
  if (!wrong) std::fprintf(stderr, "adversary-report: %s\n", slsd::to_string(wrong.error()).c_str());
  return wrong && *wrong == 0 ? 0 : 1;
}
