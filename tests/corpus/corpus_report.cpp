// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstdio>
#include <string>

#include "tests/corpus/expectations.hpp"
#include "tests/corpus/score.hpp"

namespace slsd {
namespace {

DecodeOptions papers_way() {
  DecodeOptions options;
  options.binarize = options.find_regions = options.classify = options.centre = Method::kPaper;
  options.link_grid = options.decode_windows = options.correspond = Method::kPaper;
  return options;
}

void print_score(const Score& score) {
  std::printf(" %.2f | %.2f | %zu | ", score.decoded_percent(), score.inlier_percent(), score.wrong.size());
  if (score.measured == 0) return static_cast<void>(std::printf("- | - | - |"));
  std::printf("%.3f | %+.3f | %.2f |", score.depth_rms_mm, score.depth_bias_mm, score.depth_worst_mm);
}

Result<> print_row(std::string_view name, const Result<Scene>& scene) {
  if (!scene) return tl::unexpected(scene.error());
  const auto ours = decode_and_score(*scene, {});
  if (!ours) return tl::unexpected(ours.error());
  const auto papers = decode_and_score(*scene, papers_way());
  if (!papers) return tl::unexpected(papers.error());
  std::printf("| %.*s | %d |", static_cast<int>(name.size()), name.data(), ours->resolvable);
  print_score(*ours);
  print_score(*papers);
  std::puts("");
  for (const CloudPoint& point : ours->wrong)
    std::fprintf(stderr, "wrong: column %d, row %d at (%.2f, %.2f) px\n", point.column, point.row, point.camera_u,
                 point.camera_v);
  return {};
}

Result<> print_report() {
  std::puts(
      "| scene | resolvable | decoded % | inliers % | wrong | depth RMS mm | bias mm | worst mm "
      "| paper's way: decoded % | inliers % | wrong | depth RMS mm | bias mm | worst mm |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
  for (const Expectation& pattern : kPatterns)
    if (auto row = print_row(std::string(pattern.scene) + " itself", scene_of_pattern(pattern.scene)); !row) return row;
  for (const Expectation& rendered : kRendered)
    if (auto row = print_row(rendered.scene, read_scene(rendered.scene)); !row) return row;
  return {};
}

}  // namespace
}  // namespace slsd

int main() {
  const auto done = slsd::print_report();
  if (!done) std::fprintf(stderr, "corpus-report: %s\n", slsd::to_string(done.error()).c_str());
  return done ? 0 : 1;
}
