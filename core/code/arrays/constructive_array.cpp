// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/arrays/constructive_array.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "core/code/arrays/letter_source.hpp"
#include "core/code/arrays/run_index.hpp"
#include "core/code/arrays/window_index.hpp"

namespace slsd {
namespace {

constexpr int kRollbacksPerRow = 12;  // over the whole array, before a restart

// Effort that the search spends on a row before it removes rows.
struct SearchBudget {
  int steps_per_cell;
  int tries;
  int longest_rollback_rows;
};

// Without repeats, a row's own letters block it more often than the rows above.
constexpr SearchBudget kWithWindowsOnly{60, 1, 8}, kWithoutRepeats{200, 16, 2};

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
        budget_(reach == RunReach{} ? kWithWindowsOnly : kWithoutRepeats),
        steps_left_(step_budget),
        source_(options.seed),
        index_(options.letters, minimum_distance),
        row_runs_(options.rows, options.columns, options.letters, reach.along_rows),
        column_runs_(options.columns, options.rows, options.letters, reach.along_columns),
        array_{options.rows, options.columns, options.letters,
               std::vector<std::uint8_t>(static_cast<std::size_t>(options.rows) * options.columns)},
        choices_(array_.cells.size()) {
    for (int cell = 0; cell < cell_count(); ++cell) {
      choices_[cell].row = cell / options.columns;
      choices_[cell].column = cell % options.columns;
    }
  }

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
    int row = 0, column = 0;  // of the cell; divisions would take a sixth of the time
    std::array<std::uint8_t, 8> order;
    int tried = 0;
    unsigned excluded = 0;  // one bit for each letter
  };

  [[nodiscard]] int cell_count() const { return static_cast<int>(array_.cells.size()); }
  [[nodiscard]] unsigned all_letters() const { return (1U << options_.letters) - 1; }
  [[nodiscard]] int row_of(int cell) const { return choices_[cell].row; }
  [[nodiscard]] int column_of(int cell) const { return choices_[cell].column; }

  bool fill_row_in_tries() {
    for (int tries = budget_.tries; tries > 0 && steps_left_ > 0; --tries)
      if (fill_row()) return true;
    return false;
  }

  // Fills the row from its first free cell, depth first; false if the row's steps are used up or nothing fits.
  bool fill_row() {
    const int first = next_ / options_.columns * options_.columns;
    const int end = first + options_.columns;
    std::int64_t steps = std::int64_t{budget_.steps_per_cell} * options_.columns;
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
    take_back_to(std::max(0, row - 1 - source_.below(budget_.longest_rollback_rows)) * options_.columns);
  }

  void open_cell() {
    Choices& choices = choices_[next_];
    choices.tried = 0;
    choices.excluded = row_runs_.ending_recurring_run(row_of(next_), column_of(next_)) |
                       column_runs_.ending_recurring_run(column_of(next_), row_of(next_));
    if (ends_window(next_)) choices.excluded |= ending_close_window(~choices.excluded & all_letters());
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
    if ((choices.excluded >> array_.cells[next_] & 1U) != 0) return false;
    row_runs_.add(row_of(next_), column_of(next_), array_.cells[next_]);
    column_runs_.add(column_of(next_), row_of(next_), array_.cells[next_]);
    if (!ends_window(next_)) return true;
    const PackedWindow window = window_ending_at(next_);
    index_.add(window);
    if (options_.half_turn_unique) index_.add(half_turned(window));
    return true;
  }

  // Letters that end a window too close to another or to itself rotated, one bit for each letter.
  unsigned ending_close_window(unsigned asked) {
    unsigned letters = index_.closer_with(window_ending_at(next_), asked);
    if (!options_.half_turn_unique) return letters;
    for (int letter = 0; letter < options_.letters; ++letter) {
      array_.cells[next_] = static_cast<std::uint8_t>(letter);
      const PackedWindow window = window_ending_at(next_);
      if (cells_that_differ(window, half_turned(window)) < minimum_distance_) letters |= 1U << letter;
    }
    return letters;
  }

  void take_back_to(int cell) {
    while (next_ > cell) {
      --next_;
      row_runs_.remove_last(row_of(next_), column_of(next_), array_.cells[next_]);
      column_runs_.remove_last(column_of(next_), row_of(next_), array_.cells[next_]);
      if (!ends_window(next_)) continue;
      const PackedWindow window = window_ending_at(next_);
      if (options_.half_turn_unique) index_.remove_last(half_turned(window));
      index_.remove_last(window);
    }
  }

  [[nodiscard]] bool ends_window(int cell) const {
    return row_of(cell) >= kWindowSide - 1 && column_of(cell) >= kWindowSide - 1;
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
  SearchBudget budget_;
  std::int64_t steps_left_;
  LetterSource source_;
  WindowIndex index_;
  RunIndex row_runs_, column_runs_;
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
