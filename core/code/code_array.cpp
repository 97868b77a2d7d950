// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/code_array.hpp"

#include <algorithm>
#include <cassert>

#include "core/code/arrays/array_bounds.hpp"
#include "core/code/arrays/constructive_array.hpp"
#include "core/code/arrays/paper_array.hpp"
#include "core/code/arrays/runs.hpp"

namespace slsd {
namespace {

constexpr int kPaperDraws = 2000;
constexpr std::int64_t kStepsForDistanceAsked = 6'000'000;
constexpr std::int64_t kStepsForDistanceTried = 1'500'000;
constexpr std::int64_t kStepsForReachAsked = 6'000'000;
constexpr std::int64_t kStepsForReachTried = 1'500'000;
constexpr int kReachStep = 5;  // step between the reaches to try, columns or rows

// Number of windows times the words that each forbids, divided by the number of words. Greedy construction in raster
// order succeeds up to about 1.6. No trial above 1.9 ever succeeded, so the search for the largest distance starts
// below.
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
              "the constructed array fails its check: distance " + std::to_string(array.minimum_distance));
}

Result<CodeArray> construct_with(const ArrayOptions& options, int distance) {
  if (const auto bound = forbidding_bound(options, distance))
    return fail(ErrorCode::kImpossible, *bound + ": use more letters or larger symbols");
  auto array = construct_array(options, distance, RunReach{}, kStepsForDistanceAsked);
  if (!array) return fail(ErrorCode::kImpossible, searched_in_vain(options, distance));
  return verified(std::move(*array), options, distance);
}

Result<CodeArray> construct_largest(const ArrayOptions& options) {
  for (int distance = kWindowCells; distance > 1; --distance) {
    if (forbidding_bound(options, distance) || density(options, distance) > kHopelessDensity) continue;
    if (auto array = construct_array(options, distance, RunReach{}, kStepsForDistanceTried))
      return verified(std::move(*array), options, distance);
  }
  return construct_with(options, 1);
}

/// Widens the reach of the array's runs until a search fails.
class WithoutRepeats {
 public:
  /// @param windows_alone  the array of these options, with recurring runs allowed
  WithoutRepeats(const ArrayOptions& options, CodeArray windows_alone)
      : options_(options),
        distance_(options.minimum_distance.value_or(windows_alone.minimum_distance)),
        reach_{options.row_reach.value_or(0), options.column_reach.value_or(0)},
        made_(std::move(windows_alone)) {}

  Result<CodeArray> make() {
    if (const auto bound = bound_on(reach_))
      return fail(ErrorCode::kImpossible, *bound + ": use more letters or a smaller row_reach or column_reach");
    if (reach_ != RunReach{}) {
      auto array = construct_array(options_, distance_, reach_, kStepsForReachAsked);
      if (!array) return fail(ErrorCode::kImpossible, searched_in_vain_for(reach_));
      made_ = std::move(*array);
    }
    if (!options_.row_reach) widen(&RunReach::along_rows, options_.columns - kShortestRun);
    if (!options_.column_reach) widen(&RunReach::along_columns, options_.rows - kShortestRun);
    return checked();
  }

 private:
  void widen(int RunReach::*along, int end) {
    while (reach_.*along < end) {
      RunReach wider = reach_;
      wider.*along = std::min(wider.*along + kReachStep, end);
      auto array = bound_on(wider) ? std::nullopt : construct_array(options_, distance_, wider, kStepsForReachTried);
      if (!array) return;
      made_ = std::move(*array);
      reach_ = wider;
    }
  }

  [[nodiscard]] std::optional<std::string> bound_on(RunReach reach) const {
    auto bound = forbidding_run_bound(options_.letters, options_.columns, reach.along_rows);
    return bound ? bound : forbidding_run_bound(options_.letters, options_.rows, reach.along_columns);
  }

  [[nodiscard]] std::string searched_in_vain_for(RunReach reach) const {
    return "found no " + std::to_string(options_.rows) + "x" + std::to_string(options_.columns) + " array of " +
           std::to_string(options_.letters) + " letters with minimum distance " + std::to_string(distance_) +
           " without a run that recurs within " + std::to_string(reach.along_rows) + " columns and " +
           std::to_string(reach.along_columns) +
           " rows, within the search budget: try another seed, more letters, larger symbols, or a smaller row_reach, "
           "column_reach or minimum distance";
  }

  Result<CodeArray> checked() {
    made_.row_reach = repeat_free_reach(made_, Along::kRows);
    made_.column_reach = repeat_free_reach(made_, Along::kColumns);
    const bool kept = made_.row_reach >= std::min(reach_.along_rows, options_.columns - kShortestRun) &&
                      made_.column_reach >= std::min(reach_.along_columns, options_.rows - kShortestRun);
    assert(kept);
    if (kept) return verified(std::move(made_), options_, distance_);
    return fail(ErrorCode::kImpossible, "the constructed array fails its check: runs recur within " +
                                            std::to_string(made_.row_reach) + " columns and " +
                                            std::to_string(made_.column_reach) + " rows");
  }

  const ArrayOptions& options_;
  int distance_;
  RunReach reach_;
  CodeArray made_;
};

Result<CodeArray> construct(const ArrayOptions& options) {
  return options.minimum_distance ? construct_with(options, *options.minimum_distance) : construct_largest(options);
}

Result<CodeArray> construct_without_repeats(const ArrayOptions& options) {
  auto windows_alone = construct(options);
  return windows_alone ? WithoutRepeats(options, std::move(*windows_alone)).make() : windows_alone;
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

Result<> check_reach(const ArrayOptions& options) {
  const auto refuse = [](const char* what) { return fail(ErrorCode::kInvalidArgument, what); };
  if (!options.row_reach && !options.column_reach) return {};
  if (options.method != ArrayMethod::kNoRepeats)
    return refuse("row_reach and column_reach need method = \"no_repeats\"");
  for (const int reach : {options.row_reach.value_or(0), options.column_reach.value_or(0)})
    if (reach < 0 || reach > kMaxArrayExtent) return refuse("row_reach and column_reach must be 0 to 512");
  if (options.row_reach == 0 && options.column_reach == 0)
    return refuse("row_reach and column_reach are both 0, so runs may recur: use method = \"constructive\"");
  return {};
}

}  // namespace

std::string_view to_string(ArrayMethod method) {
  switch (method) {
    case ArrayMethod::kPaper:
      return "paper";
    case ArrayMethod::kConstructive:
      return "constructive";
    default:
      return "no_repeats";
  }
}

Result<> ArrayOptions::validate() const {
  const auto refuse = [](const char* what) { return fail(ErrorCode::kInvalidArgument, what); };
  if (rows < kWindowSide || columns < kWindowSide || rows > kMaxArrayExtent || columns > kMaxArrayExtent)
    return refuse("rows and columns of the array must be 3 to 512");
  if (letters < kMinLetters || letters > kMaxLetters) return refuse("an array must have 2 to 8 letters");
  if (minimum_distance && (*minimum_distance < 1 || *minimum_distance > kWindowCells))
    return refuse("minimum_distance must be 1 to 9");
  if (method == ArrayMethod::kPaper && (minimum_distance || half_turn_unique))
    return refuse(
        "the paper's method guarantees neither minimum_distance nor half_turn_unique: leave both out, or use the "
        "constructive method");
  return check_reach(*this);
}

Result<CodeArray> make_code_array(const ArrayOptions& options) {
  if (auto valid = options.validate(); !valid) return tl::unexpected(valid.error());
  if (options.method == ArrayMethod::kPaper) return draw_by_rejection(options);
  return options.method == ArrayMethod::kNoRepeats ? construct_without_repeats(options) : construct(options);
}

int array_extent(int projector_px, int symbol_size_px, int spacing_px) {
  const int pitch_px = symbol_size_px + spacing_px;
  const int cells = (projector_px + pitch_px - 1) / pitch_px;
  return (cells + kWindowSide - 1) / kWindowSide * kWindowSide;
}

}  // namespace slsd
