#include "model/state.h"

#include "materials/laws/stored_energy.h"
#include "model/field_contact_state.h"
#include "model/mapping.h"
#include "model/moving_cells.h"
#include "model/resting_nodes.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace mpm::model
{
namespace
{
/// How a number goes to another partition.
enum class Kind
{
  common, ///< the same on all ranks
  sum,    ///< a sum over ranks; the first rank takes it
  own     ///< of one rank only; starts from zero after a restart
};

/// A name with the number of a velocity field; that of the first one goes without.
std::string numbered(const std::string& name, std::size_t field)
{
  return field == 0 ? name : name + "_" + std::to_string(field);
}

/// Likewise for the entries of a vector.
template <class V, class F>
void for_each_entry(const std::string& name, Kind kind, V& vector, F& f)
{
  for (std::size_t a = 0; a < vector.size(); ++a)
    f(name + "_" + std::to_string(a), kind, vector[a]);
}

/// The numbers of a rigid surface that no script gives.
template <class C, class F>
void for_each_number(const std::string& name, C& contact, F& f)
{
  f(name + "stiff_step", Kind::common, contact.stiff_step);
  for_each_entry(name + "impulse", Kind::sum, contact.impulse, f);
  const auto add_reaction = [&f](const std::string& prefix, Kind kind, auto& reaction)
  {
    for_each_entry(prefix + "force", kind, reaction.force, f);
    for_each_entry(prefix + "moment", kind, reaction.moment, f);
    f(prefix + "normal", kind, reaction.normal);
    f(prefix + "area", kind, reaction.area);
    f(prefix + "sticking", kind, reaction.sticking);
    f(prefix + "mass", kind, reaction.mass);
    f(prefix + "load", kind, reaction.load);
    f(prefix + "energy", kind, reaction.energy);
  };
  add_reaction(name, Kind::sum, contact.reaction);
  add_reaction(name + "ranks_", Kind::common, contact.of_ranks);
  for_each_entry(name + "displacement", Kind::common, contact.body.displacement, f);
  for_each_entry(name + "velocity", Kind::common, contact.body.velocity, f);
  for (std::size_t a = 0; a < 3; ++a)
    for_each_entry(name + "rotation_" + std::to_string(a), Kind::common, contact.body.rotation[a], f);
  for_each_entry(name + "angle", Kind::common, contact.body.angle, f);
  for_each_entry(name + "spin", Kind::common, contact.body.spin, f);
  for_each_entry(name + "angular_momentum", Kind::common, contact.body.angular_momentum, f);
}

/// The one list of numbers: calls f(name, kind, number).
template <class M, class F>
void for_each_number(M& model, F&& f)
{
  f("time", Kind::common, model.time);
  f("steps", Kind::common, model.totals.steps);
  f("last_dt", Kind::common, model.last.dt);
  for (std::size_t k = 0; k < model.fields.size(); ++k)
    f(numbered("least_mass", k), Kind::common, model.fields[k].least_mass);
  f("seeded_particles", Kind::common, model.inventory.particles);
  f("seeded_mass", Kind::common, model.inventory.mass);
  f("particle_steps", Kind::sum, model.totals.particle_steps);
  f("cell_travel", Kind::common, model.moved_cells.travel);
  f("outflow_particles", Kind::sum, model.totals.outflow_particles);
  f("outflow_mass", Kind::sum, model.totals.outflow_mass);
  f("converted_cells", Kind::sum, model.totals.converted_cells);
  f("gained_particles", Kind::sum, model.totals.gained_particles);
  f("external_work", Kind::sum, model.totals.external_work);
  f("internal_work", Kind::sum, model.totals.internal_work);
  f("damping_work", Kind::sum, model.totals.damping_work);
  f("support_work", Kind::sum, model.totals.support_work);
  f("energy_stress_work", Kind::sum, model.energy.stress_work);
  f("energy_stress_work_ahead", Kind::sum, model.energy.ahead);
  f("energy_pic_loss", Kind::sum, model.energy.pic_loss);
  f("energy_outflow_kinetic", Kind::sum, model.energy.outflow_kinetic);
  f("energy_outflow_stored", Kind::sum, model.energy.outflow_stored);
  f("energy_start_balance", Kind::sum, model.energy.balance_start);
  f("energy_start_kinetic", Kind::sum, model.energy.kinetic_start);
  f("energy_start_plastic_work", Kind::sum, model.energy.plastic_start);
  f("energy_start_external_work", Kind::sum, model.energy.external_start);
  f("energy_start_stress_work", Kind::sum, model.energy.stress_start);
  f("energy_start_pic_loss", Kind::sum, model.energy.pic_start);
  f("energy_largest_work", Kind::common, model.energy.largest_work);
  f("plastic_particles", Kind::sum, model.last.plastic);
  if (model.water)
  {
    f("water_inflow", Kind::sum, model.water->inflow);
    f("drag_work", Kind::sum, model.totals.drag_work);
  }
  if (!model.field_contacts.empty())
    f("friction_work", Kind::sum, model.totals.friction_work);
  for (std::size_t k = 0; k < model.field_contacts.size(); ++k)
  {
    for_each_entry(numbered("field_contact_force", k), Kind::sum, model.field_contacts[k].force, f);
    for_each_entry(numbered("field_contact_impulse", k), Kind::sum, model.field_contacts[k].impulse, f);
  }
  for (std::size_t k = 0; k < model.contacts.size(); ++k)
  {
    const std::string name = "contact_" + std::to_string(k) + "_";
    for_each_number(name, model.contacts[k], f);
    if (!model.collisions.empty())
      for_each_entry(name + "collision_impulse", Kind::common, model.contacts[k].body.collision_impulse, f);
  }
  f("sorts", Kind::own, model.totals.sorts);
  f("order_changes", Kind::own, model.order.out_of_order);
  f("order_cost", Kind::own, model.order.cost);
}

template <class Moments>
constexpr int moments_width = sizeof(Moments) / sizeof(double);

/// Moments of the filled cells.
template <class G, class Moments, int D = G::dim>
Table table_of(const Mesh<D>& mesh, const VelocityField<G>& field, const std::string& name,
               const Array<Moments>& moments)
{
  constexpr std::size_t width = moments_width<Moments>;
  Table table{name, moments_width<Moments> + 1, {}};
  for (std::size_t c = 0; c < moments.size(); ++c)
    if (field.moments[c].mass != 0)
    {
      table.values.push_back(static_cast<double>(mesh.global_cells[c]));
      table.values.resize(table.values.size() + width);
      std::memcpy(&table.values[table.values.size() - width], &moments[c], sizeof(Moments));
    }
  return table;
}

template <class Moments>
void take(const Migration& migration, const Table& table, Array<Moments>& moments)
{
  std::fill(moments.begin(), moments.end(), Moments{});
  const auto width = static_cast<std::size_t>(table.width);
  for (std::size_t k = 0; k < table.values.size(); k += width)
  {
    const Index cell = migration.owned_cells.at(static_cast<GlobalIndex>(table.values[k]));
    std::memcpy(&moments[static_cast<std::size_t>(cell)], &table.values[k + 1], sizeof(Moments));
  }
}

template <class G>
void set_number(Model<G>& model, const Table& table, double value)
{
  for_each_number(model,
                  [&](const std::string& name, Kind, auto& number)
                  {
                    if (table.name == name)
                      number = static_cast<std::remove_cvref_t<decltype(number)>>(value);
                  });
}

/// Whether a number has stored energy in it that some law of the model does not say.
template <class G, int D = G::dim>
bool may_be_unknown(const Model<G>& model, std::string_view name)
{
  const std::array<double, max_states> state{};
  const auto says = [&](const Law& law) { return !std::isnan(stored_energy<D>(law, SymTensor<D>{}, state.data())); };
  return (name == "energy_outflow_stored" || name == "energy_start_plastic_work") &&
         !std::ranges::all_of(model.laws, says);
}

/// Whether a number cannot be below 0.
bool is_positive(std::string_view name)
{
  constexpr std::array names{"last_dt",      "cell_travel",          "seeded_mass",
                             "outflow_mass", "energy_start_kinetic", "energy_largest_work"};
  return std::ranges::find(names, name) != names.end() || name.starts_with("least_mass");
}
} // namespace

template <class G, int D>
std::vector<Table> rank_state(const Model<G>& model)
{
  std::vector<Table> tables;
  for_each_number(
      model,
      [&](const std::string& name, Kind, const auto& number)
      {
        using Limits = std::numeric_limits<std::remove_cvref_t<decltype(number)>>;
        const double most_count = Limits::is_integer ? static_cast<double>(Limits::max()) : 0.0;
        tables.push_back(
            {name, 1, {static_cast<double>(number)}, most_count, is_positive(name), may_be_unknown(model, name)});
      });
  return tables;
}

template <class G, int D>
std::vector<Table> cell_state(const Model<G>& model)
{
  std::vector<Table> tables;
  for (std::size_t k = 0; k < model.fields.size(); ++k)
  {
    const VelocityField<G>& field = model.fields[k];
    tables.push_back(table_of(model.mesh, field, numbered("moments", k), field.moments));
    if (!field.tractions.empty())
      tables.push_back(table_of(model.mesh, field, numbered("traction_moments", k), field.tractions));
  }
  if (!model.moved_cells.initial_points.empty())
    tables.push_back(moved_corners(model));
  for (std::size_t k = 0; k < model.field_contacts.size(); ++k)
    tables.push_back(touching_table(model, k));
  return tables;
}

template <class G, int D>
std::vector<Table> empty_cell_state(const Model<G>& model)
{
  std::vector<Table> tables;
  for (std::size_t k = 0; k < model.fields.size(); ++k)
  {
    tables.push_back({numbered("moments", k), moments_width<CellMoments<G>> + 1, {}});
    tables.push_back({numbered("traction_moments", k), moments_width<TractionMoments<D>> + 1, {}});
  }
  tables.push_back(no_moved_corners<D>());
  for (std::size_t k = 0; k < model.field_contacts.size(); ++k)
    tables.push_back(empty_touching_table<D>(k));
  return tables;
}

template <class G, int D>
void restore_same(Model<G>& model, Particles<D>&& particles, const std::vector<Table>& ranks,
                  const std::vector<Table>& cells)
{
  model.particles = particles;
  model.totals = {};
  model.energy = {};
  model.ready = false;
  model.failure.reset();
  prepare(model); // takes memory, and sorts; the order comes back below
  model.particles = std::move(particles);
  find_cell_runs(model, false);
  for (std::size_t k = 0; k < model.fields.size(); ++k)
  {
    VelocityField<G>& field = model.fields[k];
    field.part_shrinks = true;
    for (const Table& table : cells)
      if (table.name == numbered("moments", k))
        take(model.migration, table, field.moments);
      else if (table.name == numbered("traction_moments", k))
        take(model.migration, table, field.tractions);
    make_resting_cells(model.mesh, model.particles, field);
  }
  for (const Table& table : ranks)
    set_number(model, table, table.values.front());
  for (std::size_t k = 0; k < model.field_contacts.size(); ++k)
    for (const Table& table : cells)
      if (table.name == empty_touching_table<D>(k).name)
        take_touching(model, table, k);
  model.energy.stale = false;
  map_to_nodes(model); // so that nodal sums are there before the first step
}

template <class G, int D>
void restore_other(Model<G>& model, Particles<D>&& particles, const std::vector<Table>& ranks)
{
  model.particles = std::move(particles);
  model.totals = {};
  model.energy = {};
  model.ready = false;
  model.failure.reset();
  prepare(model);
  for_each_number(model,
                  [&](const std::string& name, Kind kind, auto& number)
                  {
                    for (const Table& table : ranks)
                    {
                      if (table.name != name || kind == Kind::own)
                        continue;
                      double value = table.values.front();
                      for (std::size_t r = 1; kind == Kind::sum && r < table.values.size(); ++r)
                        value += table.values[r];
                      if (kind == Kind::sum && model.exchange.rank != 0)
                        value = 0;
                      number = static_cast<std::remove_cvref_t<decltype(number)>>(value);
                    }
                  });
  model.energy.stale = false;
  map_to_nodes(model);
}

#define INSTANTIATE(G)                                                                                                 \
  template std::vector<Table> rank_state(const Model<G>&);                                                             \
  template std::vector<Table> cell_state(const Model<G>&);                                                             \
  template std::vector<Table> empty_cell_state(const Model<G>&);                                                       \
  template void restore_same(Model<G>&, Particles<G::dim>&&, const std::vector<Table>&, const std::vector<Table>&);    \
  template void restore_other(Model<G>&, Particles<G::dim>&&, const std::vector<Table>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
