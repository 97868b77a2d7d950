// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "docs/tables/best_symbols.hpp"

#include <algorithm>
#include <iterator>
#include <numeric>

#include "core/code/symbol.hpp"
#include "core/decode/symbols/separability.hpp"

namespace slsd {
namespace {

constexpr double kBlurs_px[] = {0.8, 1.1, 1.4};
constexpr int kLooks = 400;

void add_survey(AlphabetSurvey& survey, const LookOptions& options) {
  std::vector<int> all(kSymbolCount);
  std::iota(all.begin(), all.end(), 1);
  const auto separability = assess_separability(all, options);
  for (const SymbolPair& pair : separability->pairs) {
    const auto [at, fresh] = survey.distances.try_emplace({pair.first, pair.second}, pair.distance);
    at->second = std::min(at->second, pair.distance);
  }
  for (const SymbolLoss& loss : separability->losses) survey.losses[loss.number] += loss.share / std::size(kBlurs_px);
}

/// Sets grow by symbols of rising number and are given up once two members are closer than any pattern should have.
class Search {
 public:
  Search(const AlphabetSurvey& survey, std::size_t count) : survey_(survey), count_(count) {}

  std::vector<RankedSymbols> run() {
    extend(1);
    std::ranges::stable_sort(found_, std::ranges::greater{}, &RankedSymbols::merit);
    return std::move(found_);
  }

 private:
  void extend(int first) {
    if (chosen_.size() == count_) {
      found_.push_back(rank(survey_, chosen_));
      return;
    }
    for (int number = first; number <= kSymbolCount; ++number) {
      if (std::ranges::any_of(chosen_, [&](int c) { return survey_.distance(c, number) < kRiskyDistance; })) continue;
      chosen_.push_back(number);
      extend(number + 1);
      chosen_.pop_back();
    }
  }

  const AlphabetSurvey& survey_;
  std::size_t count_;
  std::vector<int> chosen_;
  std::vector<RankedSymbols> found_;
};

}  // namespace

AlphabetSurvey survey_alphabet(int symbol_size_px, int spacing_px) {
  AlphabetSurvey survey;
  for (const double blur_px : kBlurs_px)
    add_survey(survey,
               {.symbol_size_px = symbol_size_px, .spacing_px = spacing_px, .blur_px = blur_px, .looks = kLooks});
  return survey;
}

RankedSymbols rank(const AlphabetSurvey& survey, std::vector<int> symbols) {
  RankedSymbols ranked{std::move(symbols), 1e9, 0};
  for (std::size_t i = 0; i < ranked.symbols.size(); ++i) {
    ranked.mean_loss += survey.losses.at(ranked.symbols[i]) / static_cast<double>(ranked.symbols.size());
    for (std::size_t j = i + 1; j < ranked.symbols.size(); ++j)
      ranked.smallest_distance =
          std::min(ranked.smallest_distance, survey.distance(ranked.symbols[i], ranked.symbols[j]));
  }
  return ranked;
}

std::vector<RankedSymbols> best_symbols(const AlphabetSurvey& survey, int count, std::size_t how_many) {
  auto found = Search(survey, static_cast<std::size_t>(count)).run();
  found.resize(std::min(found.size(), how_many));
  return found;
}

}  // namespace slsd
