// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibration_file/yaml_writer.hpp"

#include <array>
#include <charconv>
#include <cmath>

namespace slsd {
namespace {

constexpr std::size_t kLineLength = 80;

// As OpenCV reads them: only a decimal point distinguishes a real number from an integer.
std::string number_text(double value) {
  if (std::isnan(value)) return ".Nan";
  if (std::isinf(value)) return value < 0 ? "-.Inf" : ".Inf";
  std::array<char, 32> text{};
  const auto format =
      value == std::floor(value) && std::abs(value) < 1e9 ? std::chars_format::fixed : std::chars_format::scientific;
  const bool whole = format == std::chars_format::fixed;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value, format, whole ? 0 : 16).ptr;
  return std::string(text.data(), end) + (whole ? "." : "");
}

}  // namespace

void YamlWriter::write(const char* key, int value) {
  line(std::string(key) + ": " + std::to_string(value));
}

void YamlWriter::write(const char* key, double value) {
  line(std::string(key) + ": " + number_text(value));
}

void YamlWriter::write(const char* key, const std::string& value) {
  std::string quoted;
  for (const char letter : value) (quoted += letter == '"' || letter == '\\' ? "\\" : "") += letter;
  line(std::string(key) + ": \"" + quoted + "\"");
}

void YamlWriter::write(const char* key, const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  line(std::string(key) + ": !!opencv-matrix");
  indent_ += 3;
  line("rows: " + std::to_string(matrix.rows()));
  line("cols: " + std::to_string(matrix.cols()));
  line("dt: d");
  std::string numbers = "data: [";
  for (Eigen::Index i = 0; i < matrix.size(); ++i) {
    const std::string number = std::string(" ").append(number_text(matrix(i / matrix.cols(), i % matrix.cols())));
    if (indent_ + numbers.size() + number.size() >= kLineLength) {
      line(numbers);
      numbers = "   ";
    }
    numbers += number + (i + 1 < matrix.size() ? "," : " ]");
  }
  line(numbers);
  indent_ -= 3;
}

}  // namespace slsd
