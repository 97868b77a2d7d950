// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/align/align_eight.hpp"
#include "core/align/pattern_field.hpp"
#include "core/code/pattern.hpp"
#include "core/decode/grid/cell_gate.hpp"
#include "core/decode/grid/sightings.hpp"
#include "core/decode/symbols/prototypes.hpp"
#include "core/exposure/frame_noise.hpp"
#include "core/image.hpp"

namespace slsd {

/// The letters of a pattern, each dark all round, at some blurs.
/// @thread thread-safe
class LetterFields {
 public:
  explicit LetterFields(const PatternOptions& pattern);
  /// That of the nearest blur.
  /// @param blur_px  standard deviation, projector px
  [[nodiscard]] const PatternField& at(float blur_px) const { return fields_.nearest(blur_px); }
  /// Where in them the middle of a letter's square is.
  [[nodiscard]] Eigen::Vector2f middle_px(int letter) const;

 private:
  float cell_px_;
  PatternFields fields_;
};

/// Finds the places of symbols whose cells are certain and whose shapes print, relief or an edge has spoilt: a centroid
/// goes with what is missing, and off its epipolar line. What there is of them is aligned with their letter instead,
/// from where at least two of their island put them, and what does not agree counts little. One is enough where they
/// fit the grid tightly, or two that are worn lie beside each other, as along a line of print: these have to agree
/// well. Where nothing beside them stands, three and more that agree hold each other.
/// @thread thread-bound: keeps its buffers; the letters are shared with copies
class SymbolMender {
 public:
  explicit SymbolMender(const Pattern& pattern);

  [[nodiscard]] const std::shared_ptr<const LetterFields>& letters() const { return letters_; }

  /// @param full        the level of a saturated pixel
  /// @param blur_px     of the pattern in the frame, standard deviation, projector px
  /// @param gate        that knows the epipolar lines
  /// @param prototypes  of the letters: where the points of their cells are
  /// @param seen        in and out: what is mended is decoded, with another place, frame, light and misfit, and what is
  ///                    damaged and hidden in its middle has a misfit without bounds
  /// @return            the sightings that are mended, in their order; stands until the next call
  const std::vector<std::int32_t>& mend(const GreyView& frame, double full, const FrameNoise& noise, float blur_px,
                                        const CellGate& gate, std::span<const Prototype> prototypes, Sightings& seen);

 private:
  struct Place {
    Eigen::Vector2f centre_px = Eigen::Vector2f::Zero();  // of the square, in the camera
    LatticeFrame frame = LatticeFrame::Zero();
    float background = 0, peak = 0;  // grey levels
    int held_by = 0;
  };
  struct Scene {
    const GreyView& frame;
    double full;
    const FrameNoise& noise;
    const PatternField& field;
    const CellGate& gate;
    std::span<const Prototype> prototypes;
    Sightings& seen;
  };
  enum class Held : std::uint8_t { kByOne, kByTwo, kAtCorner };
  [[nodiscard]] bool is_asked(const Scene& scene, std::int32_t node);
  void ask_all(const Scene& scene);
  void ask_beside(const Scene& scene, std::size_t first, Held held);
  void sort_asked();
  void mend_asked(const Scene& scene, Held held);
  [[nodiscard]] bool may_return(const Sightings& seen, std::int32_t node);
  template <class IsEnd>
  [[nodiscard]] bool is_undisputed(const Sightings& seen, std::int32_t node, int reach, const IsEnd& is_end);
  [[nodiscard]] static bool stands_with_one(const Sightings& seen, std::int32_t node,
                                            std::span<const std::int32_t> others);
  [[nodiscard]] static bool is_beside_torn(const Sightings& seen, std::int32_t node);
  [[nodiscard]] Place place_by_neighbours(const Sightings& seen, std::int32_t node) const;
  void look_at(const Scene& scene, Held held, std::int32_t node);
  void set_up(const Scene& scene, const Place& place, std::int32_t node);
  void align(const GreyView& frame, double full, const PatternField& field);
  [[nodiscard]] Eigen::Vector2f centre_of(const PatchTask& task, int letter) const;
  /// How far its tilt from its neighbours' moves the middles of its cell's sides, projector px.
  [[nodiscard]] float tilt_px(const PatchTask& task, const Place& place) const;
  [[nodiscard]] bool lies_there(const PatchTask& task, const Place& place, const Eigen::Vector2f& centre,
                                const Sightings& seen, std::int32_t node) const;
  /// Of the pixels in a square, those that agree with the letter, those that are brighter than its light or than it is
  /// there, and those that it lights, but less than it should, as on print.
  struct Shares {
    float agree, brighter, brighter_there, darkened;
    [[nodiscard]] float agree_beside_print() const;
  };
  [[nodiscard]] static Shares shares_of_square(const GreyView& frame, const PatternField& field, const PatchTask& task,
                                               const Eigen::Vector2f& middle_px, int reach);
  [[nodiscard]] static bool shows_centre(const PatchTask& task, const Shares& middle, int held_by);
  [[nodiscard]] Shares shares_of_cell(const Scene& scene, const PatchTask& task,
                                      const LatticeFrame& lattice_frame) const;
  [[nodiscard]] float support_beside_print(const Scene& scene, const PatchTask& task,
                                           const LatticeFrame& lattice_frame) const;
  void mend_groups(const Scene& scene);
  void ask_groups(const Scene& scene);
  [[nodiscard]] Place place_in_group(const Scene& scene, std::int32_t node);
  [[nodiscard]] Eigen::Vector2f onto_line(const Scene& scene, std::int32_t node, const Eigen::Vector2f& centre_px,
                                          const LatticeFrame& frame) const;
  [[nodiscard]] bool agrees_in_group(const Scene& scene, std::size_t asked) const;
  void refuse_torn_lines(const Scene& scene);
  void keep_groups(const Sightings& seen);
  [[nodiscard]] int letter_of(const CellClaim& claim) const { return array_.at(claim.row, claim.column); }
  void take_over(const PatchTask& task, const LatticeFrame& lattice_frame, std::span<const Prototype> prototypes,
                 Sightings& seen, std::int32_t node) const;

  static constexpr int kHeldBy = 2;
  /// How far its tilt from its neighbours' moves the middles of its cell's sides, projector px: parts of two surfaces
  /// look tilted more, and the place is then on neither.
  static constexpr float kTiltMaxPx = 0.5F;
  static constexpr int kMiddleReachPx = 2;    // of the square around a centre
  static constexpr float kSettledPx = 0.05F;  // the last step along the epipolar line, projector px

  CodeArray array_;
  float pitch_px_, size_px_;
  std::shared_ptr<const LetterFields> letters_;
  std::vector<std::int32_t> to_ask_, asked_, mended_;  // sightings; of those asked one place and task each
  std::vector<std::int32_t> turned_;                   // sightings at corners, tilted more than others may be
  std::vector<std::int32_t> around_;                   // what links lead to from one
  std::vector<std::uint8_t> is_around_;                // of each sighting; none is between calls
  std::vector<std::uint8_t> on_line_;                  // of each island, whether any of it is
  std::vector<std::uint8_t> verdicts_, votes_;         // of each sighting; of each task
  std::vector<std::int32_t> grouped_;                  // sightings that hold each other
  std::vector<std::int32_t> task_of_;                  // of each sighting, or -1
  std::vector<std::size_t> agreeing_;                  // tasks that show their letters where they should be
  std::vector<std::int32_t> lone_;                     // sightings of these that one alone holds
  std::vector<Place> places_;
  std::vector<PatchTask> tasks_;
};

}  // namespace slsd
