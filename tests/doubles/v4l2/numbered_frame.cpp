// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/v4l2/numbered_frame.hpp"

#include <algorithm>
#include <variant>

namespace slsd::test {
namespace {

constexpr int kCell_px = 8;
constexpr int kBits = 16;
constexpr std::uint8_t kBlack = 40;
constexpr std::uint8_t kWhite = 200;

template <class T>
std::optional<std::uint64_t> number_of_row(const T* row) {
  const auto cell = [row](int i) { return static_cast<int>(row[i * kCell_px + kCell_px / 2]); };
  const int threshold = (cell(0) + cell(1)) / 2;
  if (cell(1) <= cell(0)) return std::nullopt;
  std::uint64_t number = 0;
  for (int bit = 0; bit < kBits; ++bit) number |= static_cast<std::uint64_t>(cell(bit + 2) > threshold ? 1 : 0) << bit;
  return number;
}

template <class T>
std::optional<std::uint64_t> number_of_all(const ImageView<T>& image) {
  const auto number = number_of_row(image.row(0));
  for (int y = 1; y < image.height; ++y) {
    if (number_of_row(image.row(y)) != number) return std::nullopt;
  }
  return number;
}

}  // namespace

void numbered_frame(std::uint64_t number, Grey8& image) {
  const auto value = [number](int cell) {
    const bool white = cell == 1 || (cell >= 2 && cell < kBits + 2 && (number >> (cell - 2) & 1) != 0);
    return white ? kWhite : kBlack;
  };
  for (int x = 0; x < image.width(); ++x) image.row(0)[x] = value(x / kCell_px);
  for (int y = 1; y < image.height(); ++y) std::copy_n(image.row(0), image.width(), image.row(y));
}

std::optional<std::uint64_t> number_of(const GreyView& image) {
  return std::visit([](const auto& view) { return number_of_all(view); }, image);
}

}  // namespace slsd::test
