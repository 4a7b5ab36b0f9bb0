#include "model/state.h"

#include "model/mapping.h"

#include <algorithm>
#include <cstring>
#include <limits>

namespace mpm
{
namespace
{
/// How a number goes to another partition.
enum class Kind
{
  common, ///< the same on all ranks
  sum,    ///< a sum over ranks; the first rank takes it
  own     ///< of one rank only; begins anew
};

/// The one list of numbers: calls f(name, kind, number).
template <class M, class F>
void for_each_number(M& model, F&& f)
{
  f("time", Kind::common, model.time);
  f("steps", Kind::common, model.totals.steps);
  f("last_dt", Kind::common, model.last.dt);
  f("least_mass", Kind::common, model.work.least_mass);
  f("seeded_particles", Kind::common, model.inventory.particles);
  f("seeded_mass", Kind::common, model.inventory.mass);
  f("particle_steps", Kind::sum, model.totals.particle_steps);
  f("outflow_particles", Kind::sum, model.totals.outflow_particles);
  f("outflow_mass", Kind::sum, model.totals.outflow_mass);
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
  f("plastic_particles", Kind::sum, model.last.plastic);
  f("sorts", Kind::own, model.totals.sorts);
  f("strays", Kind::own, model.work.strays);
  f("stray_steps", Kind::own, model.work.stray_steps);
}

template <class Moments>
constexpr int moments_width = sizeof(Moments) / sizeof(double);

template <int D, class Moments>
Table table_of(const Model<D>& model, const char* name, const Array<Moments>& moments)
{
  constexpr std::size_t width = moments_width<Moments>;
  Table table{name, moments_width<Moments> + 1, {}};
  for (std::size_t c = 0; c < moments.size(); ++c)
    if (model.work.moments[c].mass != 0)
    {
      table.values.push_back(static_cast<double>(model.mesh.global_cells[c]));
      table.values.resize(table.values.size() + width);
      std::memcpy(&table.values[table.values.size() - width], &moments[c], sizeof(Moments));
    }
  return table;
}

template <int D, class Moments>
void take(const Model<D>& model, const Table& table, Array<Moments>& moments)
{
  std::fill(moments.begin(), moments.end(), Moments{});
  const auto width = static_cast<std::size_t>(table.width);
  for (std::size_t k = 0; k < table.values.size(); k += width)
  {
    const Index cell = model.work.owned_cells.at(static_cast<GlobalIndex>(table.values[k]));
    std::memcpy(&moments[static_cast<std::size_t>(cell)], &table.values[k + 1], sizeof(Moments));
  }
}

template <int D>
void set_number(Model<D>& model, const Table& table, double value)
{
  for_each_number(model,
                  [&](const char* name, Kind, auto& number)
                  {
                    if (table.name == name)
                      number = static_cast<std::remove_cvref_t<decltype(number)>>(value);
                  });
}

/// Files of before the energy balance do not have its numbers.
template <int D>
void begin_balance_where_unknown(Model<D>& model, const std::vector<Table>& ranks)
{
  if (std::none_of(ranks.begin(), ranks.end(), [](const Table& table) { return is_of_energy(table.name); }))
    start_energy_balance(model);
  model.energy.stale = false;
}
} // namespace

bool is_of_energy(std::string_view name) { return name.starts_with("energy_"); }

template <int D>
std::vector<Table> rank_state(const Model<D>& model)
{
  std::vector<Table> tables;
  for_each_number(model,
                  [&](const char* name, Kind, const auto& number)
                  {
                    using Limits = std::numeric_limits<std::remove_cvref_t<decltype(number)>>;
                    const double most_count = Limits::is_integer ? static_cast<double>(Limits::max()) : 0.0;
                    tables.push_back({name, 1, {static_cast<double>(number)}, most_count});
                  });
  return tables;
}

template <int D>
std::vector<Table> cell_state(const Model<D>& model)
{
  std::vector<Table> tables{table_of<D>(model, "moments", model.work.moments)};
  if (!model.work.tractions.empty())
    tables.push_back(table_of<D>(model, "traction_moments", model.work.tractions));
  return tables;
}

template <int D>
std::vector<Table> empty_cell_state()
{
  return {{"moments", moments_width<CellMoments<D>> + 1, {}},
          {"traction_moments", moments_width<TractionMoments<D>> + 1, {}}};
}

template <int D>
void restore_same(Model<D>& model, Particles<D>&& particles, const std::vector<Table>& ranks,
                  const std::vector<Table>& cells)
{
  model.particles = particles;
  model.totals = {};
  model.energy = {};
  model.work.ready = false;
  model.work.trouble.reset();
  prepare(model); // makes room, and sorts; the order comes back below
  model.particles = std::move(particles);
  find_cell_runs(model, false);
  model.work.soil_shrinks = true;
  for (const Table& table : cells)
    if (table.name == "moments")
      take<D>(model, table, model.work.moments);
    else
      take<D>(model, table, model.work.tractions);
  for (const Table& table : ranks)
    set_number(model, table, table.values.front());
  begin_balance_where_unknown(model, ranks);
  map_to_nodes(model); // so that nodal sums are there before the first step
}

template <int D>
void restore_other(Model<D>& model, Particles<D>&& particles, const std::vector<Table>& ranks)
{
  model.particles = std::move(particles);
  model.totals = {};
  model.energy = {};
  model.work.ready = false;
  model.work.trouble.reset();
  prepare(model);
  for_each_number(model,
                  [&](const char* name, Kind kind, auto& number)
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
  begin_balance_where_unknown(model, ranks);
  map_to_nodes(model);
}

#define INSTANTIATE(D)                                                                                                 \
  template std::vector<Table> rank_state(const Model<D>&);                                                             \
  template std::vector<Table> cell_state(const Model<D>&);                                                             \
  template std::vector<Table> empty_cell_state<D>();                                                                   \
  template void restore_same(Model<D>&, Particles<D>&&, const std::vector<Table>&, const std::vector<Table>&);         \
  template void restore_other(Model<D>&, Particles<D>&&, const std::vector<Table>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
