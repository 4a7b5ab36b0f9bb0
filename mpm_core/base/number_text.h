#pragma once
/// @file
/// Numbers in messages.

#include <array>
#include <charconv>
#include <string>

namespace mpm::base
{
/// The shortest text that reads back as the same number: 0.7, not 0.69999999999999996.
inline std::string number_text(double number)
{
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
  return {text.data(), end};
}
} // namespace mpm::base
