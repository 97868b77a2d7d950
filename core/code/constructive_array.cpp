// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/constructive_array.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "core/code/letter_source.hpp"
#include "core/code/runs.hpp"
#include "core/code/window_index.hpp"

namespace slsd {
namespace {

constexpr int kRollbacksPerRow = 12;  // over the whole array, before a restart

// Effort that the search spends on a row before it removes rows.
struct Patience {
  int steps_per_cell;
  int tries;
  int longest_rollback_rows;
};

// Without repeats, a row's own letters block it more often than the rows above.
constexpr Patience kWithWindowsOnly{60, 1, 8}, kWithoutRepeats{200, 16, 2};

CodeArray transposed(const CodeArray& array) {
  CodeArray turned{array.columns, array.rows, array.letters, {}};
  for (int row = 0; row < turned.rows; ++row)
    for (int column = 0; column < turned.columns; ++column)
      turned.cells.push_back(static_cast<std::uint8_t>(array.at(column, row)));
  return turned;
}

/// The search for one array: a stack of cells, each with its untried letters.
class Construction {
 public:
  Construction(const ArrayOptions& options, int minimum_distance, RunReach reach, std::int64_t step_budget)
      : options_(options),
        minimum_distance_(minimum_distance),
        reach_(reach),
        patience_(reach == RunReach{} ? kWithWindowsOnly : kWithoutRepeats),
        steps_left_(step_budget),
        source_(options.seed),
        index_(options.letters, minimum_distance),
        array_{options.rows, options.columns, options.letters,
               std::vector<std::uint8_t>(static_cast<std::size_t>(options.rows) * options.columns)},
        choices_(array_.cells.size()) {}

  std::optional<CodeArray> run() {
    int rollbacks = 0;
    while (next_ < cell_count()) {
      if (fill_row_in_tries()) continue;
      if (steps_left_ <= 0) return std::nullopt;
      if (rollbacks++ < kRollbacksPerRow * options_.rows) {
        roll_back();
      } else {
        take_back_to(0);
        rollbacks = 1;
      }
    }
    return array_;
  }

 private:
  struct Choices {
    std::array<std::uint8_t, 8> order;
    int tried = 0;
  };

  [[nodiscard]] int cell_count() const { return static_cast<int>(array_.cells.size()); }

  bool fill_row_in_tries() {
    for (int tries = patience_.tries; tries > 0 && steps_left_ > 0; --tries)
      if (fill_row()) return true;
    return false;
  }

  // Fills the row from its first free cell, depth first; false if the row's steps are used up or nothing fits.
  bool fill_row() {
    const int first = next_ / options_.columns * options_.columns;
    const int end = first + options_.columns;
    std::int64_t steps = std::int64_t{patience_.steps_per_cell} * options_.columns;
    next_ = first;
    open_cell();
    while (next_ < end) {
      if (steps-- <= 0 || steps_left_-- <= 0) {
        take_back_to(first);
        return false;
      }
      if (try_letter()) {
        ++next_;
        if (next_ < end) open_cell();
      } else if (choices_[next_].tried == options_.letters) {
        if (next_ == first) return false;
        take_back_to(next_ - 1);
      }
    }
    return true;
  }

  void roll_back() {
    const int row = next_ / options_.columns;
    take_back_to(std::max(0, row - 1 - source_.below(patience_.longest_rollback_rows)) * options_.columns);
  }

  void open_cell() {
    Choices& choices = choices_[next_];
    choices.tried = 0;
    for (int i = 0; i < options_.letters; ++i) {
      const int j = source_.below(i + 1);
      choices.order[i] = choices.order[j];
      choices.order[j] = static_cast<std::uint8_t>(i);
    }
  }

  bool try_letter() {
    Choices& choices = choices_[next_];
    if (choices.tried == options_.letters) return false;
    array_.cells[next_] = choices.order[choices.tried++];
    if (ends_recurring_run(1, next_ % options_.columns, reach_.along_rows) ||
        ends_recurring_run(options_.columns, next_ / options_.columns, reach_.along_columns))
      return false;
    if (!ends_window(next_)) return true;
    const PackedWindow window = window_ending_at(next_);
    if (!fits(window)) return false;
    index_.add(window);
    if (options_.half_turn_unique) index_.add(half_turned(window));
    return true;
  }

  // Whether a run that ends at the next cell resembles an earlier run in its line too much. step: distance between
  // cells of the line; position: that of the cell in the line.
  [[nodiscard]] bool ends_recurring_run(int step, int position, int reach) const {
    const std::uint8_t* const run = &array_.cells[static_cast<std::size_t>(next_)];
    for (int apart = 1; apart <= std::min(reach, position); ++apart) {
      const int longest = std::min(kLongestRun, position - apart + 1);
      int differing = 0;
      for (int back = 0; back < longest; ++back) {
        differing += run[-back * step] != run[-(back + apart) * step] ? 1 : 0;
        if (back + 1 - differing >= kShortestRun) return true;
      }
    }
    return false;
  }

  [[nodiscard]] bool fits(PackedWindow window) const {
    if (options_.half_turn_unique && cells_that_differ(window, half_turned(window)) < minimum_distance_) return false;
    return !index_.has_closer(window);
  }

  void take_back_to(int cell) {
    while (next_ > cell) {
      --next_;
      if (!ends_window(next_)) continue;
      const PackedWindow window = window_ending_at(next_);
      if (options_.half_turn_unique) index_.remove_last(half_turned(window));
      index_.remove_last(window);
    }
  }

  [[nodiscard]] bool ends_window(int cell) const {
    return cell / options_.columns >= kWindowSide - 1 && cell % options_.columns >= kWindowSide - 1;
  }

  [[nodiscard]] PackedWindow window_ending_at(int cell) const {
    PackedWindow window = 0;
    for (int row = 0; row < kWindowSide; ++row)
      for (int column = 0; column < kWindowSide; ++column)
        window = window << 4 | array_.cells[cell - row * options_.columns - column];
    return window;
  }

  const ArrayOptions& options_;
  int minimum_distance_;
  RunReach reach_;
  Patience patience_;
  std::int64_t steps_left_;
  LetterSource source_;
  WindowIndex index_;
  CodeArray array_;
  std::vector<Choices> choices_;
  int next_ = 0;  // the first empty cell
};

}  // namespace

std::optional<CodeArray> construct_array(const ArrayOptions& options, int minimum_distance, RunReach reach,
                                         std::int64_t step_budget) {
  if (reach.along_columns <= reach.along_rows) return Construction(options, minimum_distance, reach, step_budget).run();
  ArrayOptions turned = options;
  std::swap(turned.rows, turned.columns);
  std::swap(reach.along_rows, reach.along_columns);
  const auto array = Construction(turned, minimum_distance, reach, step_budget).run();
  return array ? std::optional(transposed(*array)) : std::nullopt;
}

}  // namespace slsd
