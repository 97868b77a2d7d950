// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/utc_text.hpp"

#include <algorithm>

#include <fmt/core.h>

namespace slsd {
namespace {

using std::chrono::floor;
using std::chrono::nanoseconds;
using std::chrono::system_clock;

constexpr std::string_view kShape = "0000-00-00T00:00:00";
constexpr std::size_t kDecimalsMax = 9;
constexpr int kYearMin = 1678, kYearMax = 2261;  // range of 64 bits of nanoseconds

// Uses the calendar of <chrono>, which has no time zones: fmt 9 writes a system_clock time in local time, later
// versions in UTC.
std::string text_in_seconds(std::chrono::sys_seconds time) {
  const auto day = floor<std::chrono::days>(time);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss clock(time - day);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}", int{date.year()}, unsigned{date.month()},
                     unsigned{date.day()}, clock.hours().count(), clock.minutes().count(), clock.seconds().count());
}

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

bool has_shape(std::string_view text) {
  return std::ranges::equal(text, kShape,
                            [](char c, char shape) { return is_digit(shape) ? is_digit(c) : c == shape; });
}

int number(std::string_view digits) {
  int value = 0;
  for (const char c : digits) value = 10 * value + (c - '0');
  return value;
}

// ".250" or empty.
std::optional<nanoseconds> fraction(std::string_view text) {
  if (text.empty()) return nanoseconds(0);
  std::string decimals(text.substr(1));
  if (text[0] != '.' || decimals.empty() || decimals.size() > kDecimalsMax || !std::ranges::all_of(decimals, is_digit))
    return std::nullopt;
  decimals.resize(kDecimalsMax, '0');
  return nanoseconds(number(decimals));
}

}  // namespace

std::string utc_text(system_clock::time_point time) {
  return text_in_seconds(floor<std::chrono::seconds>(time)) + "Z";
}

std::string utc_text_ms(system_clock::time_point time) {
  const auto seconds = floor<std::chrono::seconds>(time);
  const auto ms = floor<std::chrono::milliseconds>(time - seconds);
  return fmt::format("{}.{:03}Z", text_in_seconds(seconds), ms.count());
}

std::optional<system_clock::time_point> time_from_utc(std::string_view text) {
  if (!text.ends_with('Z')) return std::nullopt;
  text.remove_suffix(1);
  if (!has_shape(text.substr(0, kShape.size()))) return std::nullopt;
  const auto part = [&](std::size_t at, std::size_t size) { return number(text.substr(at, size)); };
  const std::chrono::year_month_day date(std::chrono::year(part(0, 4)),
                                         std::chrono::month(static_cast<unsigned>(part(5, 2))),
                                         std::chrono::day(static_cast<unsigned>(part(8, 2))));
  const int hour = part(11, 2), minute = part(14, 2), second = part(17, 2);
  const auto rest = fraction(text.substr(kShape.size()));
  if (part(0, 4) < kYearMin || part(0, 4) > kYearMax || !date.ok() || hour > 23 || minute > 59 || second > 59 || !rest)
    return std::nullopt;
  return std::chrono::sys_days(date) + std::chrono::hours(hour) + std::chrono::minutes(minute) +
         std::chrono::seconds(second) + *rest;
}

}  // namespace slsd
