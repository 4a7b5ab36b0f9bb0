#pragma once
/// @file
/// The pore water of an implicit step: forces of its pressure, the balance of its volume, and their tangent.
///
/// With effective stress sigma' (tension positive) and pore pressure p (compression positive; Biot 1941),
///
///     div(sigma' - p I) + rho (g - a) = 0,    div v + n / K_w dp/dt + div q = 0,
///     q = -(k / gamma_w) (grad p - rho_w (g - a)),
///
/// backward Euler takes the second equation over the step. Both are sums over particles with the cells' linear shape
/// functions; gradients and volumes are those of the start. A polynomial pressure projection of the increment (Bochev
/// and Dohrmann 2006; White and Borja 2008) keeps pressures from oscillating, with the factor that
/// `fenics_bridge.water.Consolidation` has.
///
/// Soil that may dry (`drying.h`) has S_e p in the total stress, S (n + e + n p / K_w) of water in a unit of volume
/// that has grown by e, and the conductivity k_r k.

#include "implicit/entries.h"
#include "transfer/nodal_mixed_discretisation.h"

namespace mpm::implicit
{
/// Sum V (S_e p - p_s) of a cell under the iterate: the pore pressure in the total stress [N m].
template <class G, int D = G::dim>
double pressure_sum(const Mesh<D>& mesh, const ImplicitStep<G>& step, Index cell);

/// Its derivative by the pressure of a vertex [m3].
template <int D>
inline double pressure_by_node(const PoreStep<D>& pore, Index cell, int vertex)
{
  return pore.drying.empty() ? pore.cells[cell].mean[vertex] : pore.drying[cell].by_pressure[vertex];
}

/// The tangent's column for the pressure of a node, from the derivative of forces on the soil by that pressure.
template <int D>
inline Vector<D> column_of_pressure(const PoreStep<D>& pore, Index node, Vector<D> derivative)
{
  for (double& component : derivative)
    component *= pore.held[node] ? 0 : -pore.unit;
  return derivative;
}

/// Adds the forces of the pore pressures under the iterate to the internal ones; this rank's part.
template <class G, int D = G::dim>
void add_pore_forces(const Mesh<D>& mesh, const ImplicitStep<G>& step, std::vector<NodalForces<D>>& forces);

/// `pore.content` of the iterate: zero at the solution where no pressure is prescribed.
/// @note Collective
template <class G, int D = G::dim>
void find_water_balance(const Mesh<D>& mesh, NodeExchange& exchange, const VelocityField<G>& field,
                        ImplicitStep<G>& step);

/// Gradient of the pressure at the end less what the weight and the inertia of the water balance, grad p - rho_w (g -
/// a) of a cell [Pa/m].
template <class G>
Vector<G::dim> driving_gradient(const Mesh<G::dim>& mesh, const VelocityField<G>& field, const ImplicitStep<G>& step,
                                Index cell);

/// rho_w (g - a), the part of it that the soil's motion says: weight and inertia of the water in a unit of volume
/// [N/m3].
template <class G>
Vector<G::dim> water_weight(const Mesh<G::dim>& mesh, const VelocityField<G>& field, const ImplicitStep<G>& step,
                            Index cell);

/// Volumetric strain of a cell under the iterate: of the cell itself, whose vertices average it, also with nodal mixed
/// discretisation, and where volumes do not change.
template <class G, int D = G::dim>
double volume_strain(const Mesh<D>& mesh, const VelocityField<G>& field, double dt, Index cell);

/// Volumetric strain by which the soil of a cell takes up water in the books of its particles, whose volumes are
/// averaged with nodal mixed discretisation.
template <class G, int D = G::dim>
double growth_of(const Mesh<D>& mesh, const VelocityField<G>& field, const ImplicitStep<G>& step, Index cell)
{
  return step.options.nmd ? mean_of_vertices<D>(mesh, field.integration.groups, cell, field.volumetric_strain)
                          : volume_strain(mesh, field, step.dt, cell);
}

/// Sum V k_r k dt / gamma_w of a cell, under the iterate.
template <int D>
inline const Matrix<D>& flux_of(const PoreStep<D>& pore, Index cell)
{
  return pore.drying.empty() ? pore.cells[cell].flux : pore.drying[cell].flux;
}

/// The blocks of displacement and pressure, of pressure and displacement, and of pressures alone.
template <class G, int D = G::dim>
void add_pore_entries(const Mesh<D>& mesh, const VelocityField<G>& field, const ImplicitStep<G>& step,
                      TangentSum<D>& tangent);

/// Makes the iterate have the prescribed pressures.
template <int D>
void impose_pressures(double dt, PoreStep<D>& pore);
} // namespace mpm::implicit
