#pragma once
/// @file
/// Any constitutive law.

#include "materials/laws/undrained.h"

namespace mpm::materials
{
/// Any constitutive law, as a plain value
using Law = LawList<Heterogeneous, Hencky, Undrained>;
} // namespace mpm::materials
