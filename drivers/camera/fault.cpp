// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/fault.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

namespace slsd {
namespace {

constexpr std::array<std::pair<std::string_view, FaultKind>, 7> kKinds{{{"drop", FaultKind::kDrop},
                                                                        {"tear", FaultKind::kTear},
                                                                        {"late", FaultKind::kLate},
                                                                        {"stale", FaultKind::kStale},
                                                                        {"stall", FaultKind::kStall},
                                                                        {"hang", FaultKind::kHang},
                                                                        {"disconnect", FaultKind::kDisconnect}}};
constexpr std::array<std::pair<std::string_view, double>, 3> kUnitsNs{{{"us", 1e3}, {"ms", 1e6}, {"s", 1e9}}};
constexpr double kDurationMaxNs = 3600e9;

/// The value beside the name in the table.
template <class Table>
auto look_up(const Table& table, std::string_view name) -> std::optional<decltype(table.front().second)> {
  const auto found = std::find_if(table.begin(), table.end(), [&](const auto& entry) { return entry.first == name; });
  if (found == table.end()) return std::nullopt;
  return found->second;
}

std::optional<std::uint64_t> parse_capture(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size() || number == 0) return std::nullopt;
  return number;
}

std::optional<std::chrono::nanoseconds> parse_duration(std::string_view text) {
  double number = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, std::chars_format::fixed);
  if (error != std::errc{}) return std::nullopt;
  const auto unit_ns = look_up(kUnitsNs, text.substr(static_cast<std::size_t>(end - text.data())));
  if (!unit_ns || !(number >= 0.0 && number * *unit_ns <= kDurationMaxNs)) return std::nullopt;
  return std::chrono::nanoseconds(static_cast<std::int64_t>(number * *unit_ns));
}

tl::unexpected<Error> fail_fault(std::string_view text, std::string_view what) {
  return fail(ErrorCode::kInvalidArgument, "fault \"" + std::string(text) + "\": " + std::string(what));
}

}  // namespace

Result<Fault> parse_fault(std::string_view text) {
  const std::size_t at = text.find('@');
  if (at == std::string_view::npos)
    return fail_fault(text, "write KIND@CAPTURE or KIND@CAPTURE:DURATION, as in drop@3 or late@5:200ms");
  const auto kind = look_up(kKinds, text.substr(0, at));
  if (!kind) return fail_fault(text, "the kinds are drop, tear, late, stale, stall, hang and disconnect");
  const std::string_view rest = text.substr(at + 1);
  const std::size_t colon = std::min(rest.find(':'), rest.size());
  const auto capture = parse_capture(rest.substr(0, colon));
  if (!capture) return fail_fault(text, "the capture must be a whole number, 1 or more");
  Fault fault{*kind, *capture, std::nullopt};
  if (colon == rest.size()) return fault;
  if (fault.kind == FaultKind::kDrop || fault.kind == FaultKind::kTear)
    return fail_fault(text, "drop and tear have no duration");
  fault.duration = parse_duration(rest.substr(colon + 1));
  if (!fault.duration) return fail_fault(text, "a duration is a number with us, ms or s, up to one hour, as in 200ms");
  return fault;
}

Result<std::vector<Fault>> parse_faults(const std::vector<std::string>& texts) {
  std::vector<Fault> faults;
  for (const std::string& text : texts) {
    auto fault = parse_fault(text);
    if (!fault) return tl::unexpected(std::move(fault.error()));
    faults.push_back(*fault);
  }
  return faults;
}

}  // namespace slsd
