// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/arrays/array_bounds.hpp"

#include <algorithm>
#include <tuple>

#include "core/code/arrays/runs.hpp"

namespace slsd {
namespace {

std::int64_t power(std::int64_t base, int exponent) {
  std::int64_t product = 1;
  for (int i = 0; i < exponent; ++i) product *= base;
  return product;
}

std::int64_t choose(int n, int k) {
  std::int64_t ways = 1;
  for (int i = 1; i <= k; ++i) ways = ways * (n - k + i) / i;
  return ways;
}

std::string grouped(std::int64_t number) {
  std::string digits = std::to_string(number);
  for (auto i = static_cast<std::ptrdiff_t>(digits.size()) - 3; i > 0; i -= 3)
    digits.insert(static_cast<std::size_t>(i), 1, ',');
  return digits;
}

// A window that may be read either way up uses its own word and the rotated one.
std::int64_t usable_words(const ArrayOptions& options) {
  const std::int64_t words = word_count(options.letters);
  return options.half_turn_unique ? words - power(options.letters, (kWindowCells + 1) / 2) : words;
}

std::int64_t words_needed(const ArrayOptions& options) {
  return window_count(options.rows, options.columns) * (options.half_turn_unique ? 2 : 1);
}

std::string array_in_words(const ArrayOptions& options) {
  return std::to_string(options.rows) + "x" + std::to_string(options.columns) + " has " +
         grouped(window_count(options.rows, options.columns)) + " windows" +
         (options.half_turn_unique ? ", twice that when turned" : "");
}

}  // namespace

std::int64_t word_count(int letters) {
  return power(letters, kWindowCells);
}

std::int64_t ball_size(int letters, int radius) {
  std::int64_t size = 0;
  for (int i = 0; i <= radius; ++i) size += choose(kWindowCells, i) * power(letters - 1, i);
  return size;
}

std::int64_t window_count(int rows, int columns) {
  return static_cast<std::int64_t>(rows - kWindowSide + 1) * (columns - kWindowSide + 1);
}

std::optional<std::string> forbidding_bound(const ArrayOptions& options, int minimum_distance) {
  const std::int64_t needed = words_needed(options);
  const std::string letters = std::to_string(options.letters) + " letters";
  if (needed > usable_words(options))
    return "pigeonhole bound: " + array_in_words(options) + ", but " + letters + " have only " +
           grouped(usable_words(options)) +
           (options.half_turn_unique ? " words that differ from themselves when turned" : " words of 3x3");
  const std::int64_t singleton = power(options.letters, kWindowCells - minimum_distance + 1);
  if (needed > singleton)
    return "Singleton bound: " + array_in_words(options) + ", but " + letters + " have at most " + grouped(singleton) +
           " words at distance " + std::to_string(minimum_distance);
  const std::int64_t packing = word_count(options.letters) / ball_size(options.letters, (minimum_distance - 1) / 2);
  if (needed > packing)
    return "Hamming bound: " + array_in_words(options) + ", but " + letters + " have at most " + grouped(packing) +
           " words at distance " + std::to_string(minimum_distance);
  return std::nullopt;
}

std::optional<std::string> forbidding_run_bound(int letters, int cells, int reach) {
  const std::int64_t words = power(letters, kShortestRun);
  const std::int64_t packing = power(letters, kLongestRun) / (1 + kLongestRun * (letters - 1));
  for (const auto& [name, length, most] : {std::tuple("Singleton bound: ", kShortestRun, words),
                                           {"Singleton bound: ", kLongestRun, words},
                                           {"Hamming bound: ", kLongestRun, packing}}) {
    const int runs = std::min(reach + 1, cells - length + 1);
    if (runs > most)
      return name + std::to_string(runs) + " runs of " + std::to_string(length) + " letters would have to differ in " +
             std::to_string(length - kShortestRun + 1) + ", but " + std::to_string(letters) + " letters have at most " +
             grouped(most) + " such runs";
  }
  return std::nullopt;
}

}  // namespace slsd
