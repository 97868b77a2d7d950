// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "core/decode/decoder.hpp"
#include "core/exposure/light_levels.hpp"
#include "drivers/files/read_image.hpp"
#include "tests/corpus/expectations.hpp"
#include "tests/corpus/score.hpp"

namespace slsd {
namespace {

void print_score(const Score& score) {
  std::printf(" %.2f | %.2f | %zu | ", score.decoded_percent(), score.inlier_percent(), score.wrong.size());
  if (score.measured == 0) return static_cast<void>(std::printf("- | - | - |"));
  std::printf("%.3f | %+.3f | %.2f |", score.depth_rms_mm, score.depth_bias_mm, score.depth_worst_mm);
}

/// Symbols of the scenes so far, and how many of them are not decoded for the sake of the budget of wrong cells.
struct Budget {
  double symbols = 0, cost = 0;
};

Result<> print_row(std::string_view name, const Result<Scene>& scene, Budget& budget) {
  if (!scene) return tl::unexpected(scene.error());
  const auto ours = decode_and_score(*scene, {});
  if (!ours) return tl::unexpected(ours.error());
  const auto unbudgeted = decode_and_score(*scene, {.wrong_cells_max = 1});
  if (!unbudgeted) return tl::unexpected(unbudgeted.error());
  const auto papers = decode_and_score(*scene, papers_way());
  if (!papers) return tl::unexpected(papers.error());
  std::printf("| %.*s | %d |", static_cast<int>(name.size()), name.data(), ours->resolvable);
  print_score(*ours);
  const double cost_percent = unbudgeted->decoded_percent() - ours->decoded_percent();
  budget.symbols += ours->resolvable, budget.cost += cost_percent / 100 * ours->resolvable;
  std::printf(" %.2f |", cost_percent);
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
      "| budget costs % | paper's way: decoded % | inliers % | wrong | depth RMS mm | bias mm | worst mm |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
  Budget of_patterns, of_scenes;
  for (const Expectation& pattern : kPatterns) {
    const auto row = print_row(std::string(pattern.scene) + " itself", scene_of_pattern(pattern.scene), of_patterns);
    if (!row) return row;
  }
  for (const Expectation& rendered : kRendered)
    if (auto row = print_row(rendered.scene, read_scene(rendered.scene), of_scenes); !row) return row;
  std::printf("\nOf the rendered scenes' symbols the budget costs %.2f %%.\n",
              100 * of_scenes.cost / of_scenes.symbols);
  return {};
}

/// The rules that decided on the regions that gave no point, and the guards that kept them so, the commonest first.
std::string reasons(const Decoding& decoding) {
  std::vector<std::pair<std::uint32_t, std::string>> counts;
  for (std::size_t i = 0; i < kDecodeRuleCount; ++i)
    if (text_of(decode_rule(i)).kind != RuleKind::kAccepts)
      counts.emplace_back(decoding.rules[i], to_string(decode_rule(i)));
  std::ranges::sort(counts, std::greater<>());
  std::string text;
  for (const auto& [count, reason] : counts)
    if (count > 0) text += " " + std::to_string(count) + " " + reason;
  return text;
}

/// Scenes that are not in the corpus, and their mean.
struct FolderOptions {
  DecodeOptions decode;
  bool texture = false;  ///< their images white/frame.png are divided out, where they have any
};

Result<> print_folders(std::span<const std::string> folders, const FolderOptions& options) {
  std::puts(
      "| scene | resolvable | decoded % | inliers % | wrong | depth RMS mm | bias mm | worst mm | regions rejected |\n"
      "|---|---|---|---|---|---|---|---|---|");
  double decoded = 0;
  std::size_t wrong = 0;
  for (const std::string& folder : folders) {
    const auto scene = read_scene(std::filesystem::absolute(folder).native());
    if (!scene) return tl::unexpected(scene.error());
    auto decoder = Decoder::create(scene->pattern, scene->calibration, 0, options.decode);
    if (!decoder) return tl::unexpected(decoder.error());
    SceneLight light;
    light.full = guess_full_level(view(scene->frame));
    const auto white = read_image(std::filesystem::path(folder) / "white" / "frame.png");
    if (options.texture && white) light.white = view(*white);
    const auto decoding = decode_in_light(*decoder, view(scene->frame), light);
    if (!decoding) return tl::unexpected(decoding.error());
    const Score scored = score(*scene, (*decoding)->points);
    std::printf("| %s | %d |", std::filesystem::path(folder).filename().c_str(), scored.resolvable);
    print_score(scored);
    std::printf("%s |\n", reasons(**decoding).c_str());
    decoded += scored.decoded_percent() / static_cast<double>(folders.size());
    wrong += scored.wrong.size();
  }
  std::printf("| mean of %zu | | %.2f | | %zu | | | | |\n", folders.size(), decoded, wrong);
  return {};
}

}  // namespace
}  // namespace slsd

int main(int argc, char** argv) {
  std::vector<std::string> folders;
  slsd::FolderOptions options;
  CLI::App app("Decodes scenes and prints what is decoded, what is wrong and how exact it is.");
  auto* const folders_given =
      app.add_option("folders", folders, "each with the files of a scene; without any the corpus");
  app.add_flag("--texture", options.texture, "divide out their white/frame.png")->needs(folders_given);
  app.add_option("--wrong-cells", options.decode.wrong_cells_max, "that a frame may have")->needs(folders_given);
  app.add_option("--depth-max", options.decode.depth_max_mm, "mm, for scenes beyond the usual working depth")
      ->needs(folders_given);
  CLI11_PARSE(app, argc, argv);
  const auto done = folders.empty() ? slsd::print_report() : slsd::print_folders(folders, options);
  if (!done) std::fprintf(stderr, "corpus-report: %s\n", slsd::to_string(done.error()).c_str());
  return done ? 0 : 1;
}
