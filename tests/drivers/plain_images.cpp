// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/drivers/plain_images.hpp"

#include <algorithm>

namespace slsd::test {
namespace {

void put(std::string& bytes, std::uint32_t value, int count, bool big_endian) {
  for (int i = 0; i < count; ++i)
    bytes.push_back(static_cast<char>(value >> (8 * (big_endian ? count - 1 - i : i)) & 0xff));
}

void put_samples(std::string& bytes, const Samples& samples, int row, bool big_endian) {
  const std::size_t per_row = static_cast<std::size_t>(samples.width) * samples.channels;
  for (std::size_t i = row * per_row; i < (row + 1) * per_row; ++i)
    put(bytes, samples.values[i], samples.bits / 8, big_endian);
}

std::uint32_t crc32(const std::string& bytes) {
  std::uint32_t crc = 0xffffffffu;
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc & 1 ? crc >> 1 ^ 0xedb88320u : crc >> 1;
  }
  return ~crc;
}

std::uint32_t adler32(const std::string& bytes) {
  std::uint32_t a = 1, b = 0;
  for (const char c : bytes) {
    a = (a + static_cast<unsigned char>(c)) % 65521;
    b = (b + a) % 65521;
  }
  return b << 16 | a;
}

void put_chunk(std::string& png, const std::string& type, const std::string& contents) {
  put(png, static_cast<std::uint32_t>(contents.size()), 4, true);
  png += type + contents;
  put(png, crc32(type + contents), 4, true);
}

/// zlib's frame around blocks that are not compressed.
std::string stored(const std::string& bytes) {
  std::string out("\x78\x01");
  for (std::size_t at = 0; at < bytes.size() || at == 0;) {
    const std::size_t count = std::min<std::size_t>(bytes.size() - at, 65535);
    out.push_back(at + count == bytes.size() ? 1 : 0);
    put(out, static_cast<std::uint32_t>(count), 2, false);
    put(out, static_cast<std::uint32_t>(~count & 0xffff), 2, false);
    out += bytes.substr(at, count);
    at += count;
  }
  put(out, adler32(bytes), 4, true);
  return out;
}

/// Which pixels a pass of a PNG holds; kWhole those of a picture that is not interlaced.
struct Pass {
  int x, y, dx, dy;
};
constexpr Pass kWhole{0, 0, 1, 1};
constexpr Pass kAdam7[] = {{0, 0, 8, 8}, {4, 0, 8, 8}, {0, 4, 4, 8}, {2, 0, 4, 4},
                           {0, 2, 2, 4}, {1, 0, 2, 2}, {0, 1, 1, 2}};

/// A pass row by row, each behind the filter "none" and filled up to whole bytes, the first sample's bits highest.
void put_pass(std::string& bytes, const Samples& samples, const Pass& pass) {
  for (int y = pass.y; y < samples.height && pass.x < samples.width; y += pass.dy) {
    std::string bits;
    for (int x = pass.x; x < samples.width; x += pass.dx)
      for (int c = 0; c < samples.channels; ++c)
        for (int bit = samples.bits - 1; bit >= 0; --bit)
          bits.push_back(samples.values[(y * samples.width + x) * samples.channels + c] >> bit & 1 ? '1' : '0');
    bits.resize((bits.size() + 7) / 8 * 8, '0');
    bytes.push_back(0);
    for (std::size_t i = 0; i < bits.size(); i += 8)
      bytes.push_back(static_cast<char>(std::stoi(bits.substr(i, 8), nullptr, 2)));
  }
}

std::string png_of(const Samples& samples, int colour_type, const std::string& palette, bool interlaced) {
  std::string png("\x89PNG\r\n\x1a\n"), header, rows;
  put(header, samples.width, 4, true);
  put(header, samples.height, 4, true);
  put(header, samples.bits, 1, true);
  put(header, colour_type, 1, true);
  put(header, interlaced ? 1 : 0, 3, true);
  if (!interlaced) put_pass(rows, samples, kWhole);
  for (const Pass& pass : kAdam7)
    if (interlaced) put_pass(rows, samples, pass);
  put_chunk(png, "IHDR", header);
  if (!palette.empty()) put_chunk(png, "PLTE", palette);
  put_chunk(png, "IDAT", stored(rows));
  put_chunk(png, "IEND", "");
  return png;
}

template <class T>
Samples grey_samples(const Image<T>& image) {
  return {image.width(), image.height(), 1, 8 * static_cast<int>(sizeof(T)),
          std::vector<std::uint16_t>(image.data(), image.data() + image.size())};
}

std::string pnm_header(const Samples& samples, int kind) {
  std::string header("P");
  header.append(std::to_string(kind)).append("\n# a comment\n").append(std::to_string(samples.width));
  header.append(" ").append(std::to_string(samples.height)).append(samples.bits == 8 ? "\n255\n" : "\n65535\n");
  return header;
}

void put_tag(std::string& tiff, bool big_endian, int tag, std::uint32_t count, std::uint32_t value, bool is_short) {
  put(tiff, tag, 2, big_endian);
  put(tiff, is_short ? 3 : 4, 2, big_endian);
  put(tiff, count, 4, big_endian);
  const bool in_place = is_short && count <= 2;
  put(tiff, value, in_place ? 2 : 4, big_endian);
  if (in_place) put(tiff, count == 2 ? value : 0, 2, big_endian);
}

}  // namespace

Samples samples_of(const Grey8& image) {
  return grey_samples(image);
}
Samples samples_of(const Grey16& image) {
  return grey_samples(image);
}

Samples samples_of(const ColourImage& image) {
  Samples samples{image.width(), image.height(), 3, 8, {}};
  for (std::size_t i = 0; i < image.size(); ++i)
    samples.values.insert(samples.values.end(), image.data()[i].begin(), image.data()[i].end());
  return samples;
}

std::string pnm_bytes(const Samples& samples) {
  std::string bytes = pnm_header(samples, samples.channels == 1 ? 5 : 6);
  for (int y = 0; y < samples.height; ++y) put_samples(bytes, samples, y, true);
  return bytes;
}

std::string plain_pnm_bytes(const Samples& samples) {
  std::string bytes = pnm_header(samples, samples.channels == 1 ? 2 : 3);
  for (const std::uint16_t value : samples.values) bytes += std::to_string(value) + "\n";
  return bytes;
}

std::string png_bytes(const Samples& samples, bool interlaced) {
  constexpr int kColourTypes[] = {0, 0, 4, 2, 6};
  return png_of(samples, kColourTypes[samples.channels], "", interlaced);
}

std::string palette_png_bytes(const Grey8& indices, const std::vector<Rgb>& palette) {
  std::string colours;
  for (const Rgb& colour : palette) colours.append(colour.begin(), colour.end());
  return png_of(samples_of(indices), 3, colours, false);
}

std::string tiff_bytes(const Samples& samples, bool big_endian, int rows_per_strip) {
  const int strips = (samples.height + rows_per_strip - 1) / rows_per_strip;
  const std::uint32_t row_bytes = samples.width * samples.channels * samples.bits / 8;
  std::string pixels;
  for (int y = 0; y < samples.height; ++y) put_samples(pixels, samples, y, big_endian);
  const std::uint32_t pixels_at = 8,
                      lists_at = pixels_at + static_cast<std::uint32_t>(pixels.size() + pixels.size() % 2);
  const std::uint32_t bits_at = lists_at + 8 * strips, directory_at = bits_at + 2 * samples.channels;
  std::string tiff(big_endian ? std::string("MM\0*", 4) : std::string("II*\0", 4));
  put(tiff, directory_at, 4, big_endian);
  tiff += pixels;
  tiff.resize(lists_at, '\0');
  const auto rows_in = [&](int strip) { return std::min(rows_per_strip, samples.height - strip * rows_per_strip); };
  for (int i = 0; i < strips; ++i) put(tiff, pixels_at + i * rows_per_strip * row_bytes, 4, big_endian);
  for (int i = 0; i < strips; ++i) put(tiff, rows_in(i) * row_bytes, 4, big_endian);
  for (int i = 0; i < samples.channels; ++i) put(tiff, samples.bits, 2, big_endian);
  put(tiff, 9, 2, big_endian);
  put_tag(tiff, big_endian, 256, 1, samples.width, false);
  put_tag(tiff, big_endian, 257, 1, samples.height, false);
  put_tag(tiff, big_endian, 258, samples.channels, samples.channels <= 2 ? samples.bits : bits_at, true);
  put_tag(tiff, big_endian, 259, 1, 1, true);
  put_tag(tiff, big_endian, 262, 1, samples.channels < 3 ? 1 : 2, true);
  put_tag(tiff, big_endian, 273, strips, strips == 1 ? pixels_at : lists_at, false);
  put_tag(tiff, big_endian, 277, 1, samples.channels, true);
  put_tag(tiff, big_endian, 278, 1, rows_per_strip, false);
  put_tag(tiff, big_endian, 279, strips, strips == 1 ? rows_in(0) * row_bytes : lists_at + 4 * strips, false);
  put(tiff, 0, 4, big_endian);
  return tiff;
}

Grey8 ramp8(int width, int height, int start) {
  Grey8 image(width, height);
  for (std::size_t i = 0; i < image.size(); ++i) image.data()[i] = static_cast<std::uint8_t>(start + 7 * i);
  return image;
}

Grey16 ramp16(int width, int height, int start) {
  Grey16 image(width, height);
  for (std::size_t i = 0; i < image.size(); ++i) image.data()[i] = static_cast<std::uint16_t>(start + 1777 * i);
  return image;
}

}  // namespace slsd::test
