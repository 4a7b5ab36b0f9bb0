#pragma once
/// @file
/// The conventions of the toolkit, in one place.
///
/// - Units: SI (m, kg, s, N, Pa). Angles are in degrees only where the name or the comment says so.
/// - Sign: tension positive, for stress and for strain.
/// - Dimension D: 2 is plane strain, 3 is three-dimensional.
/// - Components of stress: `xx yy zz xy` (D = 2) and `xx yy zz xy yz xz` (D = 3).
///   Strain has the same order with engineering shear, gamma = 2 epsilon.
///   In plane strain the component zz of a strain increment is zero, that of the stress is not.

#include "base/huge_pages.h"
#include "base/layers.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace mpm::base
{
/// Number of a cell, node or particle on this rank.
using Index = std::int32_t;
/// Number of a cell, node or particle over all ranks.
using GlobalIndex = std::int64_t;

/// Number of components of a symmetric tensor.
template <int D>
inline constexpr int n_stress = D == 2 ? 4 : 6;

template <int D>
using Vector = std::array<double, D>;

/// Symmetric tensor in the component order given above.
template <int D>
using SymTensor = std::array<double, n_stress<D>>;

/// A large array: one entry per particle, cell or node.
template <class T>
using Array = std::vector<T, HugePages<T>>;

/// One entry per particle.
using Column = Array<double>;

/// Input that the toolkit cannot work with. The message names the argument, its value and what was expected.
class InputError : public std::invalid_argument
{
public:
  using std::invalid_argument::invalid_argument;
};

/// A run that cannot go on: a particle that left the mesh, a value that is not finite.
class RunError : public std::runtime_error
{
public:
  using std::runtime_error::runtime_error;
};
} // namespace mpm::base
