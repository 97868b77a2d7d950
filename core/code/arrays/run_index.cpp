// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/arrays/run_index.hpp"

#include <algorithm>
#include <cassert>

#include "core/code/arrays/runs.hpp"

namespace slsd {
namespace {

constexpr int kWordBits = 64;

// The places from first up to end, end excluded, among those of a word.
std::uint64_t places_between(int first, int end, int word) {
  const int low = std::max(0, first - word * kWordBits);
  const int above = std::max(0, (word + 1) * kWordBits - end);
  return ~std::uint64_t{0} << low & ~std::uint64_t{0} >> above;
}

}  // namespace

RunIndex::RunIndex(int lines, int cells, int letters, int reach)
    : cells_(cells),
      letters_(letters),
      reach_(reach),
      words_((cells + kWordBits - 1) / kWordBits),
      places_(static_cast<std::size_t>(lines) * letters * words_),
      in_lines_(static_cast<std::size_t>(lines) * cells) {}

std::size_t RunIndex::first_word(int line, int letter) const {
  return (static_cast<std::size_t>(line) * letters_ + letter) * words_;
}

// The places that lie so far behind one with the letter.
std::uint64_t RunIndex::places_moved(int line, int letter, int word, int by) const {
  const std::uint64_t* const places = &places_[first_word(line, letter)];
  return places[word] << by | (word > 0 ? places[word - 1] >> (kWordBits - by) : 0);
}

// The places before which at least two of the last four letters equal those before `place`.
std::uint64_t RunIndex::equal_twice(int line, int place, int word) const {
  static_assert(kShortestRun == 3, "a letter ends a recurring run if it is the third that is equal");
  const std::uint8_t* const letters = &in_lines_[static_cast<std::size_t>(line) * cells_ + place];
  std::uint64_t once = 0, twice = 0;
  for (int back = 1; back < kLongestRun && back <= place; ++back) {
    const std::uint64_t equal = places_moved(line, letters[-back], word, back);
    twice |= once & equal;
    once |= equal;
  }
  return twice;
}

unsigned RunIndex::ending_recurring_run(int line, int place) const {
  unsigned ending = 0;
  const int first = std::max(0, place - reach_);
  for (int word = first / kWordBits; first < place && word * kWordBits < place; ++word) {
    const std::uint64_t before = equal_twice(line, place, word) & places_between(first, place, word);
    for (int letter = 0; letter < letters_; ++letter)
      if ((before & places_[first_word(line, letter) + word]) != 0) ending |= 1U << letter;
  }
  return ending;
}

void RunIndex::add(int line, int place, int letter) {
  in_lines_[static_cast<std::size_t>(line) * cells_ + place] = static_cast<std::uint8_t>(letter);
  places_[first_word(line, letter) + place / kWordBits] |= std::uint64_t{1} << place % kWordBits;
}

void RunIndex::remove_last(int line, int place, int letter) {
  places_[first_word(line, letter) + place / kWordBits] &= ~(std::uint64_t{1} << place % kWordBits);
}

}  // namespace slsd
