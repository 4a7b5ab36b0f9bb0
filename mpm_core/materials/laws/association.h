#pragma once
/// @file
/// Whether plastic flow is associated.

#include "materials/laws/law.h"

namespace mpm::materials
{
/// Whether the strength of a law depends on the mean stress that it gives, while its flow dilates less than associated
/// flow would. False for elastic and undrained soil; true for laws written in Python and UMATs, of which nothing is
/// known.
bool is_non_associated(const Law& law);
} // namespace mpm::materials
