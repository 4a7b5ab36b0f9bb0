#include "materials/tools/parameter.h"

#include <charconv>
#include <sstream>

namespace mpm::materials
{
std::string number_text(double number)
{
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
  return {text.data(), end};
}

void refuse(std::string_view name, double value, std::string_view range)
{
  std::ostringstream message;
  message.precision(17);
  message << name << " = " << value << ", but it must be " << range;
  throw InputError(message.str());
}
} // namespace mpm::materials
