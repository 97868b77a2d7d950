// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/adversary/rule_sweep.hpp"

#include <array>
#include <cstdio>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "tests/adversary/misled.hpp"
#include "tests/adversary/scenes/scene_frames.hpp"

namespace slsd::adversary {
namespace {

/// What a rule has done to all frames.
struct Effect {
  int frames_met = 0, frames_worse = 0;
  int wrong = 0, right = 0;  // more without the rule
};

class Sweep {
 public:
  explicit Sweep(const RuleSet& off) : off_(off) {}

  [[nodiscard]] Result<> prepare() {
    for (const int symbol_size_px : {16, 8}) {
      auto reader = Misled::of(symbol_size_px, &trial_);
      if (!reader) return tl::unexpected(reader.error());
      scene_makers_.emplace_back(reader->maker.pattern(), reader->maker.calibration());
      readers_.push_back(std::move(*reader));
    }
    return {};
  }

  [[nodiscard]] Result<> look_at(Kind kind, int number) {
    Misled& reader = readers_[static_cast<std::size_t>(number) % 2];
    const Frame frame = reader.maker.make(kind, static_cast<std::uint32_t>(number));
    return compare(reader.decoders[static_cast<std::size_t>(number) / 2 % 3], frame.image, [&](const auto& points) {
      const Verdict verdict = reader.maker.judge(frame, points, kTolerancePx);
      return Counted{verdict.wrong, verdict.right};
    });
  }

  [[nodiscard]] Result<> look_at_scene(int index, int number, bool clean) {
    Misled& reader = readers_[static_cast<std::size_t>(number) % 2];
    const SceneFrameMaker& maker = scene_makers_[static_cast<std::size_t>(number) % 2];
    const SceneFrame frame = maker.make(index, static_cast<std::uint32_t>(number), clean);
    return compare(reader.decoders[static_cast<std::size_t>(number) / 2 % 3], frame.image, [&](const auto& points) {
      const SceneVerdict verdict = maker.judge(frame.truth, points);
      return Counted{verdict.wrong, verdict.right};
    });
  }

  void print() const {
    std::printf("%d frames, all these rules: %d wrong points, %d right\n\n", frames_, wrong_, right_);
    std::puts(
        "| without | met in frames | wrong points more | frames with more | right points more "
        "|\n|---|---|---|---|---|");
    for (std::size_t i = 0; i < kDecodeRuleCount; ++i) {
      if (off_[i] || !text_of(decode_rule(i)).has_switch) continue;
      const Effect& effect = effects_[i];
      std::printf("| %s | %d | %d | %d | %d |\n", std::string(to_string(decode_rule(i))).c_str(), effect.frames_met,
                  effect.wrong, effect.frames_worse, effect.right);
    }
  }

  [[nodiscard]] int wrong() const { return wrong_; }

 private:
  struct Counted {
    int wrong = 0, right = 0;
  };
  using Judge = std::function<Counted(const std::vector<CloudPoint>&)>;

  [[nodiscard]] Result<> compare(Decoder& decoder, const Grey8& image, const Judge& judge) {
    const auto decode = [&]() -> Result<Counted> {
      const auto decoding = decoder.decode(image.view(), 255);
      if (!decoding) return tl::unexpected(decoding.error());
      return judge((*decoding)->points);
    };
    trial_.off = off_, trial_.forget();
    const auto with = decode();
    if (!with) return tl::unexpected(with.error());
    wrong_ += with->wrong, right_ += with->right, ++frames_;
    RuleSet met;
    for (std::size_t i = 0; i < kDecodeRuleCount; ++i) met[i] = trial_.met[i];
    for (std::size_t i = 0; i < kDecodeRuleCount; ++i) {
      if (!met[i] || off_[i] || !text_of(decode_rule(i)).has_switch) continue;
      trial_.off = RuleSet(off_).set(i);
      const auto without = decode();
      if (!without) return tl::unexpected(without.error());
      Effect& effect = effects_[i];
      ++effect.frames_met, effect.frames_worse += without->wrong > with->wrong;
      effect.wrong += without->wrong - with->wrong, effect.right += without->right - with->right;
    }
    return {};
  }

  RuleSet off_;
  RuleTrial trial_;
  std::vector<Misled> readers_;
  std::vector<SceneFrameMaker> scene_makers_;
  std::array<Effect, kDecodeRuleCount> effects_{};
  int frames_ = 0, wrong_ = 0, right_ = 0;
};

}  // namespace

Result<DecodeRule> rule_named(std::string_view name) {
  for (std::size_t i = 0; i < kDecodeRuleCount; ++i)
    if (text_of(decode_rule(i)).name == name && text_of(decode_rule(i)).has_switch) return decode_rule(i);
  return fail(ErrorCode::kNotFound, "the decoder has no rule \"" + std::string(name) +
                                        "\" that it can do without; docs/reasons.md lists them");
}

Result<int> sweep_rules(const ReportOptions& options, const RuleSet& off) {
  Sweep sweep(off);
  if (auto prepared = sweep.prepare(); !prepared) return tl::unexpected(prepared.error());
  for (int number = options.first; number < options.first + options.frames_of_a_kind; ++number) {
    for (const Kind kind : drawn_grid_kinds(options))
      if (auto looked = sweep.look_at(kind, number); !looked) return tl::unexpected(looked.error());
    for (const int index : drawn_scene_kinds(options))
      if (auto looked = sweep.look_at_scene(index, number, options.clean); !looked)
        return tl::unexpected(looked.error());
  }
  sweep.print();
  return sweep.wrong();
}

}  // namespace slsd::adversary
