// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size);

namespace {

std::vector<std::uint8_t> read(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void feed(const std::vector<std::uint8_t>& bytes) {
  LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
}

// Every seed as it is, cut short in 16 places, and with a byte changed in 64: what a compiler without libFuzzer can do.
void replay(std::vector<std::uint8_t> seed) {
  feed(seed);
  for (std::size_t part = 0; part < 16; ++part) {
    feed({seed.begin(), seed.begin() + static_cast<std::ptrdiff_t>(seed.size() * part / 16)});
  }
  for (std::size_t change = 0; change < 64 && !seed.empty(); ++change) {
    const std::size_t place = change * 2654435761U % seed.size();
    const std::uint8_t kept = seed[place];
    seed[place] = static_cast<std::uint8_t>(kept + 1 + 4 * change);
    feed(seed);
    seed[place] = kept;
  }
}

}  // namespace

int main(int argc, char** argv) {
  int count = 0;
  for (int i = 1; i < argc; ++i) {
    for (const auto& entry : std::filesystem::directory_iterator(argv[i])) {
      replay(read(entry.path()));
      ++count;
    }
  }
  std::cout << count << " seeds replayed\n";
  return count > 0 ? 0 : 1;
}
