// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/code_array.hpp"

#include <algorithm>
#include <cassert>

#include "core/code/array_bounds.hpp"
#include "core/code/constructive_array.hpp"
#include "core/code/paper_array.hpp"

namespace slsd {
namespace {

constexpr int kPaperDraws = 2000;
constexpr std::int64_t kStepsForDistanceAsked = 6'000'000;
constexpr std::int64_t kStepsForDistanceTried = 1'500'000;

// Windows times the words that each forbids, over all words. Raster greedy construction succeeds up to about 1.6;
// beyond 1.9 no trial ever did, and the search for the largest distance does not begin there.
constexpr double kHopelessDensity = 1.9;

double density(const ArrayOptions& options, int distance) {
  const double windows = static_cast<double>(window_count(options.rows, options.columns));
  return windows * (options.half_turn_unique ? 2 : 1) * static_cast<double>(ball_size(options.letters, distance - 1)) /
         static_cast<double>(word_count(options.letters));
}

std::string searched_in_vain(const ArrayOptions& options, int distance) {
  return "found no " + std::to_string(options.rows) + "x" + std::to_string(options.columns) + " array of " +
         std::to_string(options.letters) + " letters with minimum distance " + std::to_string(distance) +
         (options.half_turn_unique ? ", turned windows included," : "") +
         " within the search budget; no bound forbids it: try another seed, more letters, larger symbols or a smaller "
         "minimum distance";
}

Result<CodeArray> verified(CodeArray array, const ArrayOptions& options, int distance) {
  array.minimum_distance = minimum_window_distance(array, options.half_turn_unique);
  assert(array.minimum_distance >= distance);
  if (array.minimum_distance >= distance) return array;
  return fail(ErrorCode::kImpossible,
              "the array that was constructed fails its check: distance " + std::to_string(array.minimum_distance));
}

Result<CodeArray> construct_with(const ArrayOptions& options, int distance) {
  if (const auto bound = forbidding_bound(options, distance))
    return fail(ErrorCode::kImpossible, *bound + ": use more letters or larger symbols");
  auto array = construct_array(options, distance, kStepsForDistanceAsked);
  if (!array) return fail(ErrorCode::kImpossible, searched_in_vain(options, distance));
  return verified(std::move(*array), options, distance);
}

Result<CodeArray> construct_largest(const ArrayOptions& options) {
  for (int distance = kWindowCells; distance > 1; --distance) {
    if (forbidding_bound(options, distance) || density(options, distance) > kHopelessDensity) continue;
    if (auto array = construct_array(options, distance, kStepsForDistanceTried))
      return verified(std::move(*array), options, distance);
  }
  return construct_with(options, 1);
}

Result<CodeArray> draw_by_rejection(const ArrayOptions& options) {
  const int aligned = (options.rows / kWindowSide) * (options.columns / kWindowSide);
  if (aligned > word_count(options.letters))
    return fail(ErrorCode::kImpossible, "pigeonhole bound: " + std::to_string(aligned) + " aligned windows, but " +
                                            std::to_string(options.letters) + " letters have only " +
                                            std::to_string(word_count(options.letters)) +
                                            " words of 3x3: use more letters or larger symbols");
  auto array = draw_paper_array(options.rows, options.columns, options.letters, options.seed, kPaperDraws);
  if (array) return verified(std::move(*array), options, 0);
  return fail(ErrorCode::kImpossible, "none of " + std::to_string(kPaperDraws) +
                                          " random arrays has different aligned windows; no bound forbids it: use more "
                                          "letters, larger symbols or the constructive method");
}

}  // namespace

Result<> ArrayOptions::validate() const {
  const auto refuse = [](const char* what) { return fail(ErrorCode::kInvalidArgument, what); };
  if (rows < kWindowSide || columns < kWindowSide || rows > kMaxArrayExtent || columns > kMaxArrayExtent)
    return refuse("rows and columns of the array must be 3 to 512");
  if (letters < kMinLetters || letters > kMaxLetters) return refuse("an array has 2 to 8 letters");
  if (minimum_distance && (*minimum_distance < 1 || *minimum_distance > kWindowCells))
    return refuse("minimum_distance must be 1 to 9");
  if (method == ArrayMethod::kPaper && (minimum_distance || half_turn_unique))
    return refuse(
        "the paper's method promises neither minimum_distance nor half_turn_unique: leave both out, or use "
        "the constructive method");
  return {};
}

Result<CodeArray> make_code_array(const ArrayOptions& options) {
  if (auto valid = options.validate(); !valid) return tl::unexpected(valid.error());
  if (options.method == ArrayMethod::kPaper) return draw_by_rejection(options);
  return options.minimum_distance ? construct_with(options, *options.minimum_distance) : construct_largest(options);
}

int array_extent(int projector_px, int symbol_size_px, int spacing_px) {
  const int pitch_px = symbol_size_px + spacing_px;
  const int cells = (projector_px + pitch_px - 1) / pitch_px;
  return (cells + kWindowSide - 1) / kWindowSide * kWindowSide;
}

}  // namespace slsd
