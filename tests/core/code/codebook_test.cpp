// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/codebook.hpp"

#include <random>
#include <vector>

#include <gmock/gmock.h>

#include "core/code/code_array.hpp"

namespace slsd {
namespace {

constexpr int kRows = 24, kColumns = 30;

CodeArray array_of_distance_three() {
  auto array = make_code_array({.rows = kRows, .columns = kColumns, .letters = 5, .minimum_distance = 3});
  EXPECT_TRUE(array);
  return *array;
}

std::vector<Codebook::Entry> find_all(const Codebook& codebook, const Codeword& codeword) {
  std::vector<Codebook::Entry> found;
  codebook.find(codebook.key_of(codeword), [&](const Codebook::Entry& entry) { found.push_back(entry); });
  return found;
}

std::vector<Codebook::Entry> find_one_off(const Codebook& codebook, const Codeword& codeword) {
  std::vector<Codebook::Entry> found;
  codebook.find_one_off(codebook.key_of(codeword), [&](const Codebook::Entry& entry) { found.push_back(entry); });
  return found;
}

int letters_that_differ(const Codeword& a, const Codeword& b) {
  int count = 0;
  for (int i = 0; i < kWindowCells; ++i) count += a[i] != b[i];
  return count;
}

// The windows that differ in so many letters, by comparing with every one.
std::size_t windows_at(const CodeArray& array, const Codeword& codeword, int distance) {
  std::size_t count = 0;
  for (int row = 1; row + 1 < array.rows; ++row) {
    for (int column = 1; column + 1 < array.columns; ++column)
      count += letters_that_differ(codeword, codeword_at(array, row, column)) == distance;
  }
  return count;
}

testing::Matcher<Codebook::Entry> is_window(int row, int column) {
  return testing::AllOf(testing::Field(&Codebook::Entry::row, row), testing::Field(&Codebook::Entry::column, column));
}

TEST(Codebook, FindsEveryWindowOnce) {
  const CodeArray array = array_of_distance_three();
  const Codebook codebook(array, kRows, kColumns);
  for (int row = 1; row + 1 < kRows; ++row) {
    for (int column = 1; column + 1 < kColumns; ++column) {
      ASSERT_THAT(find_all(codebook, codeword_at(array, row, column)), testing::ElementsAre(is_window(row, column)));
      ASSERT_THAT(find_one_off(codebook, codeword_at(array, row, column)), testing::IsEmpty());
    }
  }
}

TEST(Codebook, FindsEveryWindowWithOneLetterChanged) {
  const CodeArray array = array_of_distance_three();
  const Codebook codebook(array, kRows, kColumns);
  for (int row = 1; row + 1 < kRows; ++row) {
    for (int column = 1; column + 1 < kColumns; ++column) {
      for (int i = 0; i < kWindowCells; ++i) {
        Codeword changed = codeword_at(array, row, column);
        const int right = changed[i];
        for (int letter = 0; letter < array.letters; ++letter) {
          if (letter == right) continue;
          changed[i] = static_cast<std::uint8_t>(letter);
          ASSERT_THAT(find_one_off(codebook, changed), testing::ElementsAre(is_window(row, column)));
          ASSERT_THAT(find_all(codebook, changed), testing::IsEmpty());
        }
      }
    }
  }
}

TEST(Codebook, FindsOfAnyLettersWhatComparisonFinds) {
  const CodeArray array = array_of_distance_three();
  const Codebook codebook(array, kRows, kColumns);
  std::mt19937 random(3);
  std::size_t hits = 0;
  for (int i = 0; i < 3000; ++i) {
    // Some way from a window: none, one or more letters changed.
    Codeword codeword = codeword_at(array, 1 + static_cast<int>(random() % (kRows - 2)),
                                    1 + static_cast<int>(random() % (kColumns - 2)));
    for (auto change = random() % 4; change > 0; --change)
      codeword[random() % kWindowCells] = static_cast<std::uint8_t>(random() % 5);
    ASSERT_EQ(find_all(codebook, codeword).size(), windows_at(array, codeword, 0));
    const auto found = find_one_off(codebook, codeword);
    ASSERT_EQ(found.size(), windows_at(array, codeword, 1));
    for (const Codebook::Entry& entry : found)
      ASSERT_EQ(letters_that_differ(codeword, codeword_at(array, entry.row, entry.column)), 1);
    hits += found.size();
  }
  EXPECT_GT(hits, 700);
  EXPECT_LT(hits, 2500);
}

TEST(Codebook, KnowsOnlyWhatIsShown) {
  const CodeArray array = array_of_distance_three();
  const Codebook codebook(array, 10, 12);
  EXPECT_THAT(find_all(codebook, codeword_at(array, 8, 10)), testing::ElementsAre(is_window(8, 10)));
  EXPECT_THAT(find_all(codebook, codeword_at(array, 9, 10)), testing::IsEmpty());
  EXPECT_THAT(find_all(codebook, codeword_at(array, 8, 11)), testing::IsEmpty());
}

TEST(CodewordAt, ReadsTheNineLettersRowByRow) {
  const CodeArray array{3, 4, 8, {0, 1, 2, 3, 4, 5, 6, 7, 7, 6, 5, 4}};
  EXPECT_EQ(codeword_at(array, 1, 2), (Codeword{1, 2, 3, 5, 6, 7, 6, 5, 4}));
}

}  // namespace
}  // namespace slsd
