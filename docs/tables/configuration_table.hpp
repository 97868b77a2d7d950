// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

namespace slsd {

/// The meaning of ConfigurationKey::value.
enum class KeyValue {
  kDefault,   ///< holds if the key is missing
  kExample,   ///< of a key that must be there
  kOptional,  ///< of a key that has no default
};

/// A key of slsd.toml.
struct ConfigurationKey {
  std::string name;
  std::string value;  ///< in TOML
  KeyValue kind = KeyValue::kDefault;
  std::string low = {}, high = {};  ///< the range of a number; empty: the meaning tells it
};

/// Keys that are explained together.
struct ConfigurationEntry {
  std::vector<ConfigurationKey> keys;
  std::string meaning;  ///< plain English; "{KEY}" stands for a key's range
};

/// A table of slsd.toml.
struct ConfigurationTable {
  std::string name;     ///< "projector"; "camera" for keys of every camera, "camera.v4l2" for those of one driver
  std::string meaning;  ///< empty: its name tells it
  std::vector<ConfigurationEntry> entries;
};

/// The tables of slsd.toml with every key, in the order of the file. The source of config/slsd.toml and slsd.toml(5).
[[nodiscard]] std::vector<ConfigurationTable> configuration_tables();

/// The part of them that concerns cameras.
[[nodiscard]] std::vector<ConfigurationTable> camera_tables();

}  // namespace slsd
