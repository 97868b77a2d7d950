// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// ITU-T T.81: F.2.2 (Huffman decoding), B.1.1.5 (entropy-coded segments), B.2.1 (restart markers).
#include "drivers/files/jpeg_scan.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <vector>

namespace slsd {
namespace {

constexpr unsigned char kMark = 0xff;
constexpr int kInvalid = -1;

/// The bits of a segment up to the marker at its end.
class Bits {
 public:
  explicit Bits(std::string_view data)
      : at_(reinterpret_cast<const unsigned char*>(data.data())), end_(at_ + data.size()) {}

  /// The next 16 bits; zeros follow the last.
  std::uint32_t peek16() {
    if (count_ < 32) fill();
    return static_cast<std::uint32_t>(bits_ >> 48);
  }

  /// @return whether that many bits were left, at most 16
  bool skip(int count) {
    bits_ <<= count;
    count_ -= count;
    return count_ >= 0;
  }

  /// Reads a difference of that many bits, at most 15, in T.81's form. @pre skip() would succeed
  int difference(int count) {
    if (count == 0) return 0;
    const int value = static_cast<int>(peek16() >> (16 - count));
    return value >> (count - 1) != 0 ? value : value - (1 << count) + 1;
  }

  /// Begins the next segment. @return the marker before it; nothing if the data ends
  std::optional<unsigned char> next_segment() {
    bits_ = 0, count_ = 0;
    for (; end_ - at_ >= 2; ++at_) {
      if (at_[0] != kMark || at_[1] == 0 || at_[1] == kMark) continue;
      const unsigned char marker = at_[1];
      at_ += 2;
      return marker;
    }
    return std::nullopt;
  }

 private:
  void fill() {
    while (count_ <= 48 && at_ != end_) {
      const bool stuffed = at_[0] == kMark;
      if (stuffed && (end_ - at_ < 2 || at_[1] != 0)) return;
      bits_ |= std::uint64_t{at_[0]} << (56 - std::max(count_, 0));
      count_ += 8;
      at_ += stuffed ? 2 : 1;
    }
  }

  const unsigned char* at_;
  const unsigned char* end_;
  std::uint64_t bits_ = 0;  ///< the next bit is the highest
  int count_ = 0;
};

/// A table of codes; eight bits look up the short ones.
class Codes {
 public:
  explicit Codes(const JHUFF_TBL& table) {
    std::copy_n(table.huffval, values_.size(), values_.begin());
    unsigned code = 0, first = 0;
    for (unsigned length = 1; length <= 16; ++length) {
      offset_[length] = static_cast<int>(first) - static_cast<int>(code);
      for (unsigned i = 0; i < table.bits[length]; ++i, ++code, ++first) {
        if (length > 8 || first >= values_.size()) continue;
        const unsigned from = code << (8 - length), count = 1u << (8 - length);
        for (unsigned j = from; j < std::min(from + count, 256u); ++j)
          short_[j] = {static_cast<std::uint8_t>(length), values_[first]};
      }
      end_[length] = code << (16 - length);
      code <<= 1;
    }
  }

  /// @return the symbol; kInvalid if there is no such code or the data ends in it
  int next(Bits& bits) const {
    const std::uint32_t ahead = bits.peek16();
    if (const Short& found = short_[ahead >> 8]; found.length > 0)
      return bits.skip(found.length) ? found.value : kInvalid;
    int length = 9;
    while (length <= 16 && ahead >= end_[length]) ++length;
    if (length > 16 || !bits.skip(length)) return kInvalid;
    return values_[static_cast<std::size_t>(offset_[length] + static_cast<int>(ahead >> (16 - length))) & 0xff];
  }

 private:
  struct Short {
    std::uint8_t length = 0, value = 0;
  };
  std::array<std::uint8_t, 256> values_;
  std::array<Short, 256> short_{};
  std::array<std::uint32_t, 17> end_{};  ///< the first code after those of each length, as 16 bits
  std::array<int, 17> offset_{};
};

/// A component's tables, and its mean level, which each block changes.
struct Component {
  const Codes *dc = nullptr, *ac = nullptr;
  int level = 0, level_max = 0;  ///< unit: steps of its quantization
};

// No picture is brighter than white, except for rounding. Lost data leaves the level wrong by its differences.
constexpr int kLevelMax = 1024, kLevelSlack = 128;

bool pass_block(Bits& bits, Component& component) {
  const int size = component.dc->next(bits);
  if (size < 0 || size > 15) return false;
  component.level += bits.difference(size);
  if (!bits.skip(size) || std::abs(component.level) > component.level_max) return false;
  for (int k = 1; k < DCTSIZE2; ++k) {
    const int symbol = component.ac->next(bits);
    if (symbol < 0 || !bits.skip(symbol & 15)) return false;
    if ((symbol & 15) == 0 && symbol != 0xf0) return true;
    k += symbol >> 4;
  }
  return true;
}

/// The smallest group of blocks in a scan (T.81: MCU).
class Unit {
 public:
  explicit Unit(const jpeg_decompress_struct& info) {
    for (int i = 0; i < NUM_HUFF_TBLS; ++i) {
      if (info.dc_huff_tbl_ptrs[i] != nullptr) dc_[i].emplace(*info.dc_huff_tbl_ptrs[i]);
      if (info.ac_huff_tbl_ptrs[i] != nullptr) ac_[i].emplace(*info.ac_huff_tbl_ptrs[i]);
    }
    for (int i = 0; i < info.comps_in_scan; ++i) {
      const jpeg_component_info& told = *info.cur_comp_info[i];
      const int step = std::max<int>(told.quant_table->quantval[0], 1);  // libjpeg has checked that the tables exist
      components_[i] = {&*dc_[told.dc_tbl_no], &*ac_[told.ac_tbl_no], 0, (kLevelMax + kLevelSlack) / step + 1};
    }
    for (int i = 0; i < info.blocks_in_MCU; ++i) blocks_.push_back(&components_[info.MCU_membership[i]]);
  }
  Unit(const Unit&) = delete;
  Unit& operator=(const Unit&) = delete;

  void restart() {
    for (Component& component : components_) component.level = 0;
  }

  bool pass(Bits& bits) {
    return std::ranges::all_of(blocks_, [&](Component* component) { return pass_block(bits, *component); });
  }

 private:
  std::array<std::optional<Codes>, NUM_HUFF_TBLS> dc_, ac_;
  std::array<Component, MAX_COMPS_IN_SCAN> components_;
  std::vector<Component*> blocks_;
};

}  // namespace

ScanBlocks count_blocks(const jpeg_decompress_struct& info, std::string_view data) {
  Unit unit(info);
  Bits bits(data);
  std::uint64_t left = std::uint64_t{info.MCUs_per_row} * info.MCU_rows_in_scan;
  const std::uint64_t interval = info.restart_interval == 0 ? left : info.restart_interval;
  while (true) {
    const std::uint64_t here = std::min(left, interval);
    unit.restart();
    for (std::uint64_t i = 0; i < here; ++i)
      if (!unit.pass(bits)) return ScanBlocks::kMissing;
    if (unit.pass(bits)) return ScanBlocks::kLeftOver;
    left -= here;
    if (left == 0) return ScanBlocks::kAgree;
    const auto marker = bits.next_segment();
    if (!marker || *marker < JPEG_RST0 || *marker > JPEG_RST0 + 7) return ScanBlocks::kMissing;
  }
}

}  // namespace slsd
