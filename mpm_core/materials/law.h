#pragma once
/// @file
/// Any constitutive law.

#include "materials/law_list.h"

namespace mpm
{
/// Any constitutive law, as a plain value
using Law = LawList<>;
} // namespace mpm
