#pragma once
/// @file
/// Velocities of soil and water at a node whose drag depends on the direction.

#include "base/eigen.h"
#include "model/velocity_field.h"

namespace mpm::explicit_scheme
{
/// Velocities, or forces, of soil and water.
template <int D>
struct Phases
{
  Vector<D> soil, water;
};

/// The velocities at the end of a step, m_s v = a + dt C (w - v) and m_w w = b - dt C (w - v), with the soil's support.
/// @param soil_mass, water_mass  m_s, m_w, both positive
/// @param momenta  a, b: with the impulses of all forces but the drag
/// @param drag  dt C, symmetric
/// @param support  of the soil; null for none
template <int D>
Phases<D> velocities_after_drag(double soil_mass, double water_mass, const Phases<D>& momenta, const Matrix<D>& drag,
                                const Support<D>* support)
{
  using Square = Eigen::Matrix<double, D, D>;
  using Column = Eigen::Matrix<double, D, 1>;
  const auto column = [](const Vector<D>& v) -> Column { return Eigen::Map<const Column>(v.data()); };
  const Square c = as_eigen<D>(drag), one = Square::Identity();
  const Square water = (water_mass * one + c).inverse(); // w = (m_w + dt C)^-1 (b + dt C v)
  const Square soil = soil_mass * one + water_mass * c * water;
  Column held = Column::Zero();
  Square along = Square::Zero();
  for (int k = 0; support && k < support->count; ++k)
  {
    const Column n = column(support->direction[k]);
    along += n * n.transpose();
    held += support->value[k] * n;
  }
  const Square free = one - along;
  const Column right = column(momenta.soil) + c * water * column(momenta.water);
  const Column v = held + (free * soil * free + along).inverse() * (free * (right - soil * held));
  const Column w = water * (column(momenta.water) + c * v);
  Phases<D> end;
  for (int a = 0; a < D; ++a)
  {
    end.soil[a] = v[a];
    end.water[a] = w[a];
  }
  return end;
}
} // namespace mpm::explicit_scheme
