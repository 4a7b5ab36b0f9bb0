#pragma once

#include "materials/tools/parameter.h"

#include <string_view>

namespace mpm::materials
{
/// Throws InputError naming the parameter, its value and the allowed range, unless `allowed` holds.
inline void require(bool allowed, std::string_view name, double value, std::string_view range)
{
  if (!allowed)
    refuse(name, value, range);
}
} // namespace mpm::materials
