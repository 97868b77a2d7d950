// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

#include "tests/doubles/gige/gige_faults.hpp"
#include "tests/doubles/gige/register_file.hpp"

namespace slsd::test {

/// Exposes as the registers say: at a trigger, at an action whose time has come, or freely. Keeps the exposures until
/// they are sent.
/// @thread thread-bound
class Sensor {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// As the register kTriggerSource numbers them.
  enum class Source : std::uint32_t { kLine0, kSoftware, kLine1, kAction1 };

  struct Exposure {
    std::uint16_t id;
    std::uint32_t counter;
    Time begin;
    Time ready;  ///< to be sent
  };

  /// @param trouble  outlives this; its counts of exposures are used up here
  explicit Sensor(GigeTrouble& trouble);

  /// Forgets everything but its counter.
  /// @param registers  outlive this, or are followed by others at the next call
  /// @param readout    from an exposure's end to its sending; without it, it is sent as it begins
  void power_up(const RegisterFile& registers, std::uint16_t first_id,
                std::optional<std::chrono::microseconds> readout);

  /// Hears no trigger until then.
  void arm_at(Time time) { armed_at_ = time; }
  /// The next frame has the number 1.
  void restart_ids() { next_id_ = 1; }
  /// When the exposure of this counter began. Precondition: it is one of the last 1024.
  [[nodiscard]] Time begin_of(std::uint32_t counter) const { return begins_[counter % begins_.size()]; }

  /// Exposes, if this is the source that is waited for.
  void trigger(Source source);
  void act_at(Time time) { act_at_ = time; }
  /// Exposes where it is time to.
  void expose_when_due(Time now);
  /// When it will be time to, as far as is known; Time::max() where it is not.
  [[nodiscard]] Time next_due() const;

  /// Whether one is to be sent.
  [[nodiscard]] bool has_exposures(Time now) const { return !exposures_.empty() && exposures_.front().ready <= now; }
  /// The oldest that is not sent. Precondition: has_exposures(now).
  [[nodiscard]] Exposure take_exposure();
  void discard_exposures() { exposures_.clear(); }

  [[nodiscard]] std::uint32_t counter() const { return counter_; }
  [[nodiscard]] Time last_exposure() const { return last_exposure_; }

 private:
  void act(Time now);
  void run_freely(Time now);
  void expose(Time begin);
  void add_exposure(Time begin);

  GigeTrouble& trouble_;
  const RegisterFile* registers_ = nullptr;
  std::optional<std::chrono::microseconds> readout_;
  std::vector<Exposure> exposures_;  ///< not yet sent
  std::uint16_t next_id_ = 1;
  std::uint32_t counter_ = 0;
  Time last_exposure_;
  Time armed_at_;
  std::array<Time, 1024> begins_{};  ///< by the counter
  std::optional<Time> next_free_;
  std::optional<Time> act_at_;
};

}  // namespace slsd::test
