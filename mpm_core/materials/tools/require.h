#pragma once

#include "base/number_text.h"
#include "base/types.h"

#include <string>
#include <string_view>

namespace mpm::materials
{
/// Throws InputError naming the parameter, its value and the allowed range, unless `allowed` holds.
inline void require(bool allowed, std::string_view name, double value, std::string_view range)
{
  if (allowed)
    return;
  throw InputError(std::string(name) + " = " + number_text(value) + ", but it must be " + std::string(range));
}
} // namespace mpm::materials
