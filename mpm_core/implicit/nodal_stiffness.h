#pragma once
/// @file
/// The elastic stiffness at the nodes: what scales the tangent of an implicit step and the frequencies of its damping.

#include "model/material_points.h"

namespace mpm::implicit
{
/// sum_p V_p M |grad N_i|^2 of each node for a modulus M of the points [Pa]; this rank's part [N/m].
template <int D>
std::vector<double> nodal_stiffness(const Mesh<D>& mesh, const MaterialPoints<D>& points, double WaveModuli::*modulus);
} // namespace mpm::implicit
