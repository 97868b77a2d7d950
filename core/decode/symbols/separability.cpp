// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/separability.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include <Eigen/Cholesky>

#include "core/code/symbol.hpp"
#include "core/decode/symbols/prototypes.hpp"

namespace slsd {
namespace {

using Features = Eigen::Matrix<double, kFeatureCount, 1>;

double distance_between(const SymbolSpread& a, const SymbolSpread& b) {
  const Features apart = b.mean - a.mean;
  const Features along = FeatureCovariance(a.covariance + b.covariance).llt().solve(apart);
  const double sigmas = std::sqrt(along.dot(a.covariance * along)) + std::sqrt(along.dot(b.covariance * along));
  return sigmas > 0 ? along.dot(apart) / sigmas : 0.0;
}

Result<> check(const std::vector<int>& symbols, const LookOptions& options) {
  const auto refuse = [](const char* what) { return fail(ErrorCode::kInvalidArgument, what); };
  if (symbols.size() < 2) return refuse("separability needs at least two symbols");
  if (std::set<int>(symbols.begin(), symbols.end()).size() != symbols.size()) return refuse("symbols must differ");
  if (std::ranges::any_of(symbols, [](int number) { return number < 1 || number > kSymbolCount; }))
    return refuse("symbols must be 1 to 25");
  if (std::ranges::find(kSymbolSizesPx, options.symbol_size_px) == std::end(kSymbolSizesPx))
    return refuse("symbol_size_px must be 8, 10, 12, 14 or 16");
  if (!(options.camera_px_per_projector_px >= 0.2 && options.camera_px_per_projector_px <= 10))
    return refuse("camera_px_per_projector_px must be 0.2 to 10");
  if (!(options.blur_px >= 0.1 && options.blur_px <= 20)) return refuse("blur_px must be 0.1 to 20");
  if (options.looks < 10 || options.looks > 100000) return refuse("looks must be 10 to 100000");
  if (options.spacing_px < 1 || options.spacing_px > 16) return refuse("spacing_px must be 1 to 16");
  return {};
}

std::string named(int number) {
  return std::to_string(number) + " (" + std::string(symbol(number).name) + ")";
}

std::string one_decimal(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", value);
  return text;
}

}  // namespace

std::vector<SymbolPair> Separability::risky_pairs() const {
  std::vector<SymbolPair> risky;
  std::ranges::copy_if(pairs, std::back_inserter(risky),
                       [](const SymbolPair& pair) { return pair.distance < kRiskyDistance; });
  return risky;
}

std::vector<SymbolLoss> Separability::risky_symbols() const {
  std::vector<SymbolLoss> risky;
  std::ranges::copy_if(losses, std::back_inserter(risky),
                       [](const SymbolLoss& loss) { return loss.share > kRiskyLoss; });
  return risky;
}

Result<Separability> assess_separability(const std::vector<int>& symbols, const LookOptions& options) {
  if (auto valid = check(symbols, options); !valid) return tl::unexpected(valid.error());
  const std::vector<SymbolSpread> spreads =
      spread_of_symbols({.symbols = symbols,
                         .symbol_size_px = options.symbol_size_px,
                         .spacing_px = options.spacing_px,
                         .camera_px_per_projector_px = static_cast<float>(options.camera_px_per_projector_px),
                         .frame_error = static_cast<float>(options.frame_error),
                         .samples = options.looks,
                         .blur_px = static_cast<float>(options.blur_px),
                         .noise = static_cast<float>(options.noise)});
  Separability result;
  for (std::size_t i = 0; i < symbols.size(); ++i) {
    result.losses.push_back({symbols[i], spreads[i].lost});
    for (std::size_t j = i + 1; j < symbols.size(); ++j)
      result.pairs.push_back({symbols[i], symbols[j], distance_between(spreads[i], spreads[j])});
  }
  std::ranges::sort(result.pairs, {}, &SymbolPair::distance);
  return result;
}

std::vector<std::string> separability_warnings(const Separability& separability, int symbol_size_px) {
  const std::string at_size = " at " + std::to_string(symbol_size_px) + " px";
  std::vector<std::string> warnings;
  for (const SymbolPair& pair : separability.risky_pairs())
    warnings.push_back("symbols " + named(pair.first) + " and " + named(pair.second) + " look alike" + at_size + ": " +
                       one_decimal(pair.distance) + " standard deviations to the boundary, " +
                       one_decimal(kRiskyDistance) + " needed; choose another pair or a larger size");
  for (const SymbolLoss& loss : separability.risky_symbols())
    warnings.push_back("symbol " + named(loss.number) + " breaks up or merges with its neighbours" + at_size + " in " +
                       one_decimal(100 * loss.share) +
                       " % of views; choose another symbol, more spacing or a larger size");
  return warnings;
}

}  // namespace slsd
