// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <fastcdr/Cdr.h>
#include <fastcdr/exceptions/Exception.h>

namespace slsd::dds {

/// A message as it is on the wire: four bytes that say how it is encoded, then plain CDR, little-endian.
using Bytes = std::vector<std::uint8_t>;

/// A struct with `fields`, which calls a function with all of its members in the order of the wire.
template <typename Value>
concept Message = requires(Value& value) {
  Value::fields(value, [](auto&...) {});
};

namespace detail {

using eprosima::fastcdr::Cdr;

template <typename Value>
concept MessageSequence = Message<typename Value::value_type> && requires(Value& value) {
  value.emplace_back();
};

template <typename Value>
void put(Cdr& cdr, const Value& value) {
  if constexpr (Message<Value>) {
    Value::fields(value, [&](const auto&... member) { (put(cdr, member), ...); });
  } else if constexpr (MessageSequence<Value>) {
    cdr << static_cast<std::uint32_t>(value.size());
    for (const auto& each : value) put(cdr, each);
  } else {
    cdr << value;
  }
}

// A sequence grows by what was read: a length that the bytes do not hold ends in an exception, not in an allocation.
template <typename Value>
void get(Cdr& cdr, Value& value) {
  if constexpr (Message<Value>) {
    Value::fields(value, [&](auto&... member) { (get(cdr, member), ...); });
  } else if constexpr (MessageSequence<Value>) {
    std::uint32_t count = 0;
    cdr >> count;
    value.clear();
    for (std::uint32_t i = 0; i < count; ++i) get(cdr, value.emplace_back());
  } else {
    cdr >> value;
  }
}

}  // namespace detail

/// @thread reentrant
template <Message Value>
[[nodiscard]] Bytes encode(const Value& message) {
  using eprosima::fastcdr::Cdr;
  eprosima::fastcdr::FastBuffer buffer;
  Cdr cdr(buffer, Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR);
  cdr.serialize_encapsulation();
  detail::put(cdr, message);
  const auto* begin = reinterpret_cast<const std::uint8_t*>(buffer.getBuffer());
  return {begin, begin + cdr.getSerializedDataLength()};
}

/// Decodes a message; empty if the bytes are none. Bytes behind it are passed over. @thread reentrant
template <Message Value>
[[nodiscard]] std::optional<Value> decode(const Bytes& bytes) {
  using eprosima::fastcdr::Cdr;
  // Fast CDR takes no constant bytes; it only reads them.
  eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(const_cast<std::uint8_t*>(bytes.data())), bytes.size());
  Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
  std::optional<Value> message(std::in_place);
  try {
    cdr.read_encapsulation();
    detail::get(cdr, *message);
  } catch (const eprosima::fastcdr::exception::Exception&) {
    return std::nullopt;
  }
  return message;
}

}  // namespace slsd::dds
