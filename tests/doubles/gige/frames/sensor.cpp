// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/gige/frames/sensor.hpp"

#include <algorithm>
#include <cmath>

namespace slsd::test {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

std::uint16_t id_after(std::uint16_t id) {
  return id == 65535 ? 1 : static_cast<std::uint16_t>(id + 1);
}

}  // namespace

Sensor::Sensor(GigeTrouble& trouble) : trouble_(trouble) {
  exposures_.reserve(1024);
}

void Sensor::power_up(const RegisterFile& registers, std::uint16_t first_id,
                      std::optional<std::chrono::microseconds> readout) {
  registers_ = &registers;
  readout_ = readout;
  exposures_.clear();
  next_id_ = first_id;
  next_free_.reset();
  act_at_.reset();
}

void Sensor::trigger(Source source) {
  if (steady_clock::now() < armed_at_) return;
  const bool waits =
      registers_->read(kTriggerMode) == 1 && registers_->read(kTriggerSource) == static_cast<std::uint32_t>(source);
  if (waits && registers_->read(kAcquisition) == 1) expose(steady_clock::now());
}

void Sensor::expose_when_due(Time now) {
  act(now);
  run_freely(now);
}

void Sensor::act(Time now) {
  if (!act_at_ || now < *act_at_) return;
  act_at_.reset();
  trigger(Source::kAction1);
}

void Sensor::run_freely(Time now) {
  if (registers_->read(kAcquisition) != 1 || registers_->read(kTriggerMode) != 0) return next_free_.reset();
  if (!next_free_) next_free_ = now;
  if (now < *next_free_) return;
  const std::chrono::microseconds period(std::max(registers_->read(kFramePeriodUs), 1u));
  // A camera whose link is slower than its sensor exposes less often.
  if (exposures_.size() < 2) expose(*next_free_);
  *next_free_ += period;
  if (*next_free_ < now) next_free_ = now;
}

Sensor::Time Sensor::next_due() const {
  const Time ready = exposures_.empty() ? Time::max() : exposures_.front().ready;
  return std::min({next_free_.value_or(Time::max()), act_at_.value_or(Time::max()), ready});
}

void Sensor::expose(Time begin) {
  GigeFaults& faults = trouble_.faults;
  last_exposure_ = begin;
  add_exposure(begin);
  if (faults.stale_frames > 0) {
    --faults.stale_frames;
    exposures_.back().begin -= 1s;
  }
  if (faults.extra_frames > 0) {
    --faults.extra_frames;
    add_exposure(begin);
  }
  if (faults.drop_frames > 0) --faults.drop_frames, exposures_.pop_back();
  if (faults.silent || trouble_.off()) exposures_.clear();
}

void Sensor::add_exposure(Time begin) {
  begins_[counter_ % begins_.size()] = begin;
  Time ready = begin;
  if (readout_) ready += std::chrono::microseconds(std::lround(registers_->read_double(kExposureTime))) + *readout_;
  exposures_.push_back({next_id_, counter_++, begin, ready});
  next_id_ = id_after(next_id_);
}

Sensor::Exposure Sensor::take_exposure() {
  const Exposure first = exposures_.front();
  exposures_.erase(exposures_.begin());
  return first;
}

}  // namespace slsd::test
