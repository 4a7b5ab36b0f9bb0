#pragma once
/// @file
/// Many explicit steps in a row, and what they amount to.

#include "explicit/explicit_step.h"
#include "model/resting.h"

namespace mpm::explicit_scheme
{
struct RunOptions
{
  double until = 0;            ///< time at which to stop, met exactly [s]
  std::optional<double> dt;    ///< step [s]; by default `courant` times the critical one
  double courant = 0.5;        ///< alpha_c of (17)
  double pic = 0;              ///< PIC fraction of a critical time step, in [0, 1]; takes the place of that of a step
  bool allow_unstable = false; ///< take `dt` even above the critical step
  std::int64_t max_steps = 0;  ///< return earlier, after this many steps
  std::optional<Conversion> conversion; ///< of resting cells, at each control interval; without one they stay
};

/// Steps between two looks at the critical time step.
inline constexpr std::int64_t control_interval = 32;

/// Steps until a time is reached or `max_steps` are done. Within a control interval the step is the same, and the last
/// interval's step is shortened so that the time is met.
/// @returns steps done
/// @throws InputError `dt` above the critical step (both numbers are given)
/// @throws RunError a particle left the mesh, a value is not finite, a law failed; with its place; on all ranks alike
/// @note Collective
template <class G>
std::int64_t run_explicit(Model<G>& model, const ExplicitOptions& options, const RunOptions& run);

/// What stopped a step of the model, in words.
template <class G, int D = G::dim>
std::string failure_text(const Model<G>& model, const Failure<D>& failure);

/// Where a run stands, summed over ranks. Units SI; energies in J, masses in kg (per metre in plane strain).
struct Diagnostics
{
  double particles;
  double mass;
  double momentum[3];
  double kinetic_energy;
  double external_work;
  double internal_work;
  double damping_work;
  double support_work;
  double drag_work;     ///< of the flow of pore water through the soil
  double friction_work; ///< taken out where velocity fields touch
  double stress_work;   ///< of the particles' stresses on their strains
  double stored_energy; ///< by elastic strain; NaN where a law does not say
  double plastic_work;  ///< stress work less stored energy since the particles were last changed by anything but a step
  double pic_loss;      ///< kinetic energy taken out by PIC
  double nodal_kinetic_energy;
  double unexplained_energy; ///< see model/energy.h; since the particles were last changed by anything but a step
  double energy_scale;       ///< largest of the works and energies since then
  double outflow_particles;
  double outflow_mass;
  double particle_steps;
  double plastic_fraction; ///< of the particles, in the last step
  double resting_cells;
  double converted_cells;
  double unbalanced_ratio; ///< |f_ext - f_int| / |f_ext| in the last step; 0 without external force
};

/// @throws RunError on all ranks: particles, mass or momentum were lost or counted twice
/// @note Collective
template <class G>
Diagnostics diagnostics(const Model<G>& model);
} // namespace mpm::explicit_scheme
