// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibration_file/file_section.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slsd {
namespace {

constexpr std::size_t kMaxElements = 14;  // for the longest distortion vector of OpenCV
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

using Kind = FileNode::Kind;

bool is_control(char letter) {
  return static_cast<unsigned char>(letter) < 0x20 || letter == 0x7f;
}

}  // namespace

void FileSection::refuse(const std::string& key, const std::string& problem) {
  if (!error_) error_ = Error{ErrorCode::kMalformed, path_ + key + " " + problem, where_};
}

bool FileSection::has(const char* key) const {
  return node_.find(key) != nullptr;
}

const FileNode* FileSection::find(const char* key) {
  const FileNode* const node = node_.find(key);
  if (node == nullptr) refuse(key, "is missing");
  return node;
}

double FileSection::number(const char* key) {
  const FileNode* const node = find(key);
  if (node == nullptr) return 0.0;
  if (node->kind != Kind::kNumber || !std::isfinite(node->number)) {
    refuse(key, "must be a number");
    return 0.0;
  }
  return node->number;
}

int FileSection::whole(const char* key, int low, int high) {
  const double value = number(key);
  if (!(value >= low && value <= high) || value != std::floor(value)) {
    refuse(key, "must be a whole number from " + std::to_string(low) + " to " + std::to_string(high));
    return 0;
  }
  return static_cast<int>(value);
}

std::string FileSection::text(const char* key) {
  const FileNode* const node = find(key);
  if (node == nullptr) return {};
  const std::string& value = node->text;
  if (value.empty() || value.size() > kMaxTextLength || std::any_of(value.begin(), value.end(), is_control)) {
    refuse(key, "must be a string in quotes, of 1 to " + std::to_string(kMaxTextLength) + " bytes");
    return {};
  }
  return value;
}

std::vector<double> FileSection::elements(const char* key, int& rows, int& columns) {
  const FileNode* const node = find(key);
  if (node == nullptr) return {};
  const FileNode* const data = node->find("data");
  if (data == nullptr || node->find("rows") == nullptr || node->find("cols") == nullptr) {
    refuse(key, "must be a matrix (!!opencv-matrix with rows, cols, dt and data)");
    return {};
  }
  FileSection matrix(*node, path_ + key + ".", where_);
  rows = matrix.whole("rows", 1, kMaxElements);
  columns = matrix.whole("cols", 1, kMaxElements);
  const std::vector<FileNode>& items = data->items;
  if (matrix.error() || items.size() != static_cast<std::size_t>(rows) * columns) {
    refuse(key, "must have rows x cols numbers, at most " + std::to_string(kMaxElements));
    return {};
  }
  std::vector<double> values;
  for (const FileNode& item : items) values.push_back(item.kind == Kind::kNumber ? item.number : kNone);
  if (!std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); })) {
    refuse(key, "must hold only finite numbers");
  }
  return values;
}

Eigen::Matrix3d FileSection::matrix3(const char* key) {
  int rows = 0, columns = 0;
  const std::vector<double> values = elements(key, rows, columns);
  if (rows != 3 || columns != 3) refuse(key, "must be 3x3");
  if (error_) return Eigen::Matrix3d::Zero();
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(values.data());
}

Eigen::VectorXd FileSection::vector(const char* key, int count, const std::string& hint) {
  int rows = 0, columns = 0;
  const std::vector<double> values = elements(key, rows, columns);
  if (std::min(rows, columns) != 1 || std::max(rows, columns) != count) {
    const std::string shape = "must be 1x" + std::to_string(count) + " or " + std::to_string(count) + "x1";
    refuse(key, shape + (hint.empty() ? "" : ": " + hint));
  }
  if (error_) return Eigen::VectorXd::Zero(count);
  return Eigen::Map<const Eigen::VectorXd>(values.data(), count);
}

}  // namespace slsd
