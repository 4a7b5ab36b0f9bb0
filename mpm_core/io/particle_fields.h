#pragma once
/// @file
/// Fields of particles as output takes them, without copies.

#include "io/series.h"
#include "particles/particles.h"

namespace mpm::io
{
/// Fields that point into the particles' columns.
/// @param names  columns of the particles, `displacement` (position minus initial position) or `plastic_strain` (the
///               first state variable); the position is there anyway
/// @throws InputError for a field that there is not
template <int D>
ParticleFields particle_fields(const Particles<D>& particles, const std::vector<std::string>& names);
} // namespace mpm::io
