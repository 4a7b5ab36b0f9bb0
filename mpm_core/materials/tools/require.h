#pragma once

#include "base/types.h"

#include <sstream>
#include <string_view>

namespace mpm::materials
{
/// Throws InputError naming the parameter, its value and the allowed range, unless `allowed` holds.
inline void require(bool allowed, std::string_view name, double value, std::string_view range)
{
  if (allowed)
    return;
  std::ostringstream message;
  message.precision(17);
  message << name << " = " << value << ", but it must be " << range;
  throw InputError(message.str());
}
} // namespace mpm::materials
