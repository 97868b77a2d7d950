// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstdlib>
#include <ostream>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/adversary/misled.hpp"

namespace slsd::adversary {

void PrintTo(Kind kind, std::ostream* out) {
  *out << to_string(kind);
}

namespace {

/// Frames of each kind: 4, or as many as SLSD_ADVERSARY_FRAMES says.
int frames_of_a_kind() {
  const char* const asked = std::getenv("SLSD_ADVERSARY_FRAMES");
  return asked == nullptr ? 4 : std::atoi(asked);
}

struct Bench {
  static Bench of(int symbol_size_px) { return {Misled::of(symbol_size_px).value()}; }

  void expect_none_wrong(Kind kind, int number) {
    const Frame frame = misled.maker.make(kind, static_cast<std::uint32_t>(number));
    const auto decoding = misled.decoders[number / 2 % 3].decode(frame.image.view(), 255);  // as in ./run adversary
    ASSERT_TRUE(decoding);
    EXPECT_EQ(misled.maker.judge(frame, (*decoding)->points, 1.5).wrong, 0) << to_string(kind) << ", frame " << number;
  }

  Misled misled;
};

class Adversary : public testing::TestWithParam<Kind> {};

TEST_P(Adversary, GetsNoWrongCell) {
  for (const int size_px : {16, 8}) {
    Bench bench = Bench::of(size_px);
    for (int number = 0; number < frames_of_a_kind(); ++number) bench.expect_none_wrong(GetParam(), number);
  }
}

// Two or three symbols at the corner of a surface, or the end of a row between two shelves, are those of another
// surface and fit by chance.
TEST(AdversaryFrames, NameNoPieceOfAnotherSurfaceAtARim) {
  Bench fine = Bench::of(8), coarse = Bench::of(16);
  for (const auto& [kind, number] : {std::pair(Kind::kShelves, 1),
                                     {Kind::kShelves, 67},
                                     {Kind::kPickets, 87},
                                     {Kind::kPickets, 2700313},
                                     {Kind::kSwappedPatch, 37},
                                     {Kind::kSwappedPatch, 43},
                                     {Kind::kSwappedPatch, 55}})
    fine.expect_none_wrong(kind, number);
  for (const int number : {68, 82}) coarse.expect_none_wrong(Kind::kSwappedPatch, number);
  // Two halves, of a symbol of a shelf and of one beyond it, that look like one.
  for (const int number : {128, 166, 332, 334, 390, 566, 8350}) coarse.expect_none_wrong(Kind::kShelves, number);
  for (const int number : {121, 289, 321, 479, 573, 861, 892, 1161, 180369})
    fine.expect_none_wrong(Kind::kShelves, number);
}

// The corner of something put there agrees by chance, or what is beside it.
TEST(AdversaryFrames, NameNothingBesideWhatIsPutInThePatternsPlace) {
  Bench fine = Bench::of(8), coarse = Bench::of(16);
  for (const int number : {279, 533, 17200447, 25000111}) fine.expect_none_wrong(Kind::kSwappedPatch, number);
  for (const int number : {292, 25000936}) coarse.expect_none_wrong(Kind::kSwappedPatch, number);
  fine.expect_none_wrong(Kind::kSlidRows, 539);
  coarse.expect_none_wrong(Kind::kSlats1to2, 760);
}

// Along a torn row the symbols look whole whose letters are the same on both surfaces.
TEST(AdversaryFrames, NameNothingInARowThatAnEdgeRunsAlong) {
  Bench fine = Bench::of(8), coarse = Bench::of(16);
  for (const int number :
       {60069,   900587,  1100289, 1300307,  1400177,  1500209,  1600381,  2100143,  5100343,  5102303,  7100359,
        8000705, 8001469, 8301385, 10002347, 10101983, 13300509, 13700411, 14100661, 15101017, 15101669, 15201151})
    fine.expect_none_wrong(Kind::kShelves, number);
  for (const int number : {1300398, 1500070, 5201382, 8002136, 8002224, 9600128, 13600200, 14200206, 15101404})
    coarse.expect_none_wrong(Kind::kShelves, number);
  for (const int number : {8500353, 13000449}) fine.expect_none_wrong(Kind::kSlats1to2, number);
  fine.expect_none_wrong(Kind::kSlats3to6, 5201859);
  for (const int number : {8000836, 13400308}) coarse.expect_none_wrong(Kind::kSlats3to6, number);
}

// What an edge along the row tears shows light beside its letters; what it leaves whole tells nothing.
TEST(AdversaryFrames, NameNothingWhoseLineShowsOtherLight) {
  Bench fine = Bench::of(8), coarse = Bench::of(16);
  for (const int number : {15002303, 15100339, 15100981, 15300619, 15501327, 25001409, 26002063})
    fine.expect_none_wrong(Kind::kShelves, number);
  for (const int number : {14000702, 14001734, 14600478, 15201376, 15300300, 18000450, 19200474, 19601000})
    coarse.expect_none_wrong(Kind::kShelves, number);
  fine.expect_none_wrong(Kind::kSlats1, 18100161);
  coarse.expect_none_wrong(Kind::kSlats1, 16100150);
  coarse.expect_none_wrong(Kind::kSlats1to2, 27000020);
}

// What lies around them is looked at beyond the symbols of other islands.
TEST(AdversaryFrames, NameNoneThatHoldEachOtherOnAnotherSurface) {
  Bench fine = Bench::of(8), coarse = Bench::of(16);
  for (const int number : {19400035, 19500109, 25000239}) fine.expect_none_wrong(Kind::kSlats1to2, number);
  for (const int number : {19400939, 19701005}) fine.expect_none_wrong(Kind::kSlats2, number);
  coarse.expect_none_wrong(Kind::kSlats2, 19501014);
  fine.expect_none_wrong(Kind::kShelves, 19400373);
  fine.expect_none_wrong(Kind::kPickets, 19500821);
}

// Symbols that the border cuts have no letter, and link with nothing.
TEST(AdversaryFrames, NameNothingThatTheBorderOfTheFrameLeavesAlone) {
  Bench fine = Bench::of(8), coarse = Bench::of(16);
  for (const int number : {60418, 600342, 1700472, 5100456, 5201686, 5301614, 5302142})
    coarse.expect_none_wrong(Kind::kSwappedPatch, number);
  fine.expect_none_wrong(Kind::kPickets, 700333);
}

// Links along a picket are broken but between two of its symbols.
TEST(AdversaryFrames, NameNoTwoOfAPicket) {
  Bench fine = Bench::of(8), coarse = Bench::of(16);
  for (const int number : {6300309, 8002127, 8300029, 9200549}) fine.expect_none_wrong(Kind::kPickets, number);
  coarse.expect_none_wrong(Kind::kSlats1to2, 8700356);
}

// The neighbours of one that an edge cuts put it on the next.
TEST(AdversaryFrames, NameNothingWhereAnotherSymbolIs) {
  Bench::of(8).expect_none_wrong(Kind::kPickets, 2400263);
}

// Half of a shelf's letters fit by chance, from edge to edge of it.
TEST(AdversaryFrames, NameNoRowThatIsOffTheGrid) {
  Bench fine = Bench::of(8), coarse = Bench::of(16);
  for (const int number : {40470, 71102, 220548}) coarse.expect_none_wrong(Kind::kShelves, number);
  fine.expect_none_wrong(Kind::kShelves, 41119);
  fine.expect_none_wrong(Kind::kSlats1to2, 40675);
}

// What lies near a grid by chance, or beside one that is itself of two surfaces, is not on it.
TEST(AdversaryFrames, NameNothingThatIsNearTheGridByChance) {
  Bench fine = Bench::of(8), coarse = Bench::of(16);
  coarse.expect_none_wrong(Kind::kSlats1, 20404);
  coarse.expect_none_wrong(Kind::kSlats1to2, 20102);
  for (const int number : {20095, 220567}) fine.expect_none_wrong(Kind::kShelves, number);
  for (const int number : {60334, 180356}) coarse.expect_none_wrong(Kind::kPickets, number);
}

// Letters of another surface that fit because they come again some columns on.
TEST(AdversaryFrames, NameNoRowThatIsAnotherOneSlid) {
  Bench fine = Bench::of(8), coarse = Bench::of(16);
  for (const int number : {2329, 2365, 3333, 3363, 4521}) fine.expect_none_wrong(Kind::kShelves, number);
  for (const int number : {3020, 3312, 4088, 9276}) coarse.expect_none_wrong(Kind::kShelves, number);
  fine.expect_none_wrong(Kind::kShelves, 2000201);
  fine.expect_none_wrong(Kind::kSlats1, 1555);
  coarse.expect_none_wrong(Kind::kSlats1to2, 4272);
  coarse.expect_none_wrong(Kind::kSlats2, 3068);
}

std::vector<Kind> all_kinds() {
  std::vector<Kind> kinds;
  for (int i = 0; i < kKinds; ++i) kinds.push_back(static_cast<Kind>(i));
  return kinds;
}

INSTANTIATE_TEST_SUITE_P(Kinds, Adversary, testing::ValuesIn(all_kinds()));

// The frames are drawn as they are judged, and are no riddles: nearly all of broad slats and of plain parts is read.
TEST(AdversaryFrames, AreReadWhereNothingMisleads) {
  const auto pattern = make_pattern({});
  ASSERT_TRUE(pattern);
  FrameMaker maker(*pattern, pattern->array);
  auto decoder = Decoder::create(*pattern, maker.calibration(), 0, {});
  int right = 0, visible = 0;
  for (std::uint32_t number = 0; number < 6; ++number) {
    const Frame frame = maker.make(Kind::kForeign, number);  // of the same array: a plane that shows the pattern
    const Verdict verdict = maker.judge(frame, (*decoder->decode(frame.image.view(), 255))->points, 1.5);
    right += verdict.right + verdict.undecidable, visible += 600;
  }
  EXPECT_GT(right, visible * 8 / 10);
}

}  // namespace
}  // namespace slsd::adversary
