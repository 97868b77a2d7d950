// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <fastcdr/Cdr.h>
#include <fastcdr/exceptions/Exception.h>

namespace slsd::dds {

/// A serialized message: four bytes with the encoding, then plain CDR, little-endian.
using Bytes = std::vector<std::uint8_t>;

/// A struct with `fields`, which calls a function with all members in serialization order.
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

// A sequence grows while it is read: a false length ends in an exception, not in a huge allocation.
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

/// Decodes a message; empty if the bytes are invalid. Ignores bytes after it. @thread reentrant
template <Message Value>
[[nodiscard]] std::optional<Value> decode(const Bytes& bytes) {
  using eprosima::fastcdr::Cdr;
  // Fast CDR requires a non-const pointer, but only reads.
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
