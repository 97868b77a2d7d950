// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/code/pattern.hpp"
#include "core/decode/centres/align_letters.hpp"
#include "core/decode/grid/neighbourhood.hpp"
#include "core/decode/grid/sightings.hpp"

namespace slsd {

/// What lies around a symbol that does not stand and speaks against its cell.
/// @thread thread-bound: keeps its buffers
class Disputes {
 public:
  explicit Disputes(const Pattern& pattern);

  /// Whether nothing disputes a node's cell that links on the grid lead to through what does not stand: nothing is well
  /// seen and has another cell, or another letter than the pattern has there.
  /// @param reach   links
  /// @param is_end  (node, whether it has the cell that the links lead to) -> bool: what else disputes it
  template <class IsEnd>
  [[nodiscard]] bool none_around(const Sightings& seen, std::int32_t node, int reach, const IsEnd& is_end);
  [[nodiscard]] bool none_around(const Sightings& seen, std::int32_t node, int reach);
  /// Those that the last look has come to and that have the cell that the links lead to.
  [[nodiscard]] const std::vector<std::int32_t>& of_surface() const { return of_surface_; }

 private:
  CodeArray array_;
  float pitch_px_;
  LinkWalk walk_;
  std::vector<std::int32_t> of_surface_;
};

/// The guard of all that brings symbols back: the aligning of a letter came to an end.
[[nodiscard]] bool has_settled(const Rules& rules, CellClaim& claim, const PatchTask& task);

/// Finds the places of symbols where nothing beside them stands that could hold them: those beside each other hold each
/// other. A plane of the grid is laid through what is known of them, and three and more that show their letters where
/// it has them are decoded. See docs/decoder.md, "Where nothing stands".
/// @thread thread-bound: keeps its buffers; the letters are shared with copies
class GroupMender {
 public:
  GroupMender(const Pattern& pattern, std::shared_ptr<const LetterFields> letters, Rules rules = {});

  /// To be called before the first of a frame's rounds.
  void start(const Sightings& seen);
  /// One round: what is decoded between two of them may hold more.
  /// @return  the sightings that are decoded now; stands until the next call
  const std::vector<std::int32_t>& mend(const LetterScene& scene);

 private:
  struct Member {
    AskedLetter letter;
    bool shows_letter;
    std::optional<bool> shows_other_light = std::nullopt;  // where it was asked for
  };
  void find_members(const LetterScene& scene);
  void align_members(const LetterScene& scene);
  [[nodiscard]] LetterPlace place_of(const LetterScene& scene, std::int32_t node);
  [[nodiscard]] bool shows_letter(const LetterScene& scene, const AskedLetter& asked) const;
  void refuse_torn_lines(const LetterScene& scene);
  void keep_groups(Sightings& seen);

  float pitch_px_, size_px_;
  Rules rules_;
  LetterAligner aligner_;
  Disputes disputes_;
  LinkWalk walk_;
  std::vector<std::uint8_t> is_on_line_;  // of each island, whether any of it is
  std::vector<std::uint8_t> verdicts_;    // of each sighting
  std::vector<std::int32_t> to_ask_;      // sightings
  std::vector<Member> known_;             // of the frame, each as it was aligned last
  std::vector<std::int32_t> known_of_;    // of each sighting, or -1
  std::vector<std::int32_t> asked_of_;    // of each sighting, those that take part in this round
  std::vector<std::int32_t> agreeing_;    // of known_
  std::vector<std::uint8_t> agrees_;      // of each sighting
  std::vector<std::int32_t> mended_;
};

}  // namespace slsd
