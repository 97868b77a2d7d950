// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/light_curve.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace slsd {
namespace {

constexpr int kGreys = 256;

// The position, 0 to 1, at which the rising response reaches this share of its span.
double invert(const std::vector<double>& response, double share) {
  const double light = response.front() + share * (response.back() - response.front());
  const auto above = std::lower_bound(response.begin() + 1, response.end() - 1, light);
  const auto index = above - response.begin();
  const double below = response[static_cast<std::size_t>(index - 1)];
  const double part = std::clamp((light - below) / (*above - below), 0.0, 1.0);
  return (static_cast<double>(index - 1) + part) / static_cast<double>(response.size() - 1);
}

double value_for(const LightOptions& options, double light) {
  if (options.gamma.size() > 1) return invert(options.gamma, light);
  return std::pow(light, 1.0 / options.gamma.front());
}

Result<> check_gamma(const std::vector<double>& gamma) {
  if (gamma.size() == 1 && gamma[0] >= 0.1 && gamma[0] <= 10) return {};
  const bool rising = std::ranges::adjacent_find(gamma, std::greater_equal<>()) == gamma.end();
  if (gamma.size() >= 2 && gamma.size() <= kGreys && rising) return {};
  return fail(ErrorCode::kInvalidArgument, "gamma must be 0.1 to 10, or a rising list of 2 to 256 light values");
}

}  // namespace

Result<> LightOptions::validate() const {
  if (!(brightness >= 0.0 && brightness <= 1.0)) {
    return fail(ErrorCode::kInvalidArgument, "brightness must be 0 to 1, not " + std::to_string(brightness));
  }
  if (black_level < 0 || black_level > 254) {
    return fail(ErrorCode::kInvalidArgument, "black_level must be 0 to 254");
  }
  return check_gamma(gamma);
}

LightCurve::LightCurve(const LightOptions& options) {
  for (int grey = 0; grey < kGreys; ++grey) {
    const double share = value_for(options, options.brightness * grey / 255.0);
    values_[static_cast<std::size_t>(grey)] =
        static_cast<std::uint8_t>(std::lround(options.black_level + share * (255 - options.black_level)));
  }
}

bool LightCurve::is_identity() const {
  for (int grey = 0; grey < kGreys; ++grey) {
    if (values_[static_cast<std::size_t>(grey)] != grey) return false;
  }
  return true;
}

Grey8 LightCurve::apply(const Grey8& image) const {
  Grey8 sent = image;
  std::transform(image.data(), image.data() + image.size(), sent.data(), *this);
  return sent;
}

}  // namespace slsd
