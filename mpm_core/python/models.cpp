#include "python/bindings.h"

#include "base/number_text.h"
#include "explicit/critical_step.h"
#include "explicit/run.h"
#include "explicit/two_phase_step.h"
#include "model/absorbing.h"
#include "model/averaged_values.h"
#include "model/contacts.h"
#include "model/far_field.h"
#include "model/integration.h"
#include "model/mapping.h"
#include "model/members.h"
#include "model/moving_cells.h"
#include "model/placement.h"
#include "model/rebalance.h"
#include "model/resting.h"
#include "model/water_boundary.h"
#include "model/water_mapping.h"
#include "particles/seed.h"
#include "python/arrays.h"
#include "python/nodal_field.h"
#include "python/particle_columns.h"

#include <limits>
#include <optional>

namespace mpm::python
{
namespace
{
py::dict as_dict(const Diagnostics& d)
{
  using namespace py::literals;
  return py::dict(
      "particles"_a = static_cast<std::int64_t>(d.particles), "mass"_a = d.mass,
      "momentum"_a = std::vector<double>(d.momentum, d.momentum + 3), "kinetic_energy"_a = d.kinetic_energy,
      "external_work"_a = d.external_work, "internal_work"_a = d.internal_work, "damping_work"_a = d.damping_work,
      "support_work"_a = d.support_work, "drag_work"_a = d.drag_work, "friction_work"_a = d.friction_work,
      "stress_work"_a = d.stress_work, "stored_energy"_a = d.stored_energy, "plastic_work"_a = d.plastic_work,
      "pic_loss"_a = d.pic_loss, "nodal_kinetic_energy"_a = d.nodal_kinetic_energy,
      "unexplained_energy"_a = d.unexplained_energy, "energy_scale"_a = d.energy_scale,
      "outflow_particles"_a = static_cast<std::int64_t>(d.outflow_particles), "outflow_mass"_a = d.outflow_mass,
      "particle_steps"_a = d.particle_steps, "plastic_fraction"_a = d.plastic_fraction,
      "resting_cells"_a = static_cast<std::int64_t>(d.resting_cells),
      "converted_cells"_a = static_cast<std::int64_t>(d.converted_cells), "unbalanced_ratio"_a = d.unbalanced_ratio);
}

/// An entry of a node on absorbing sides: damping, stiffness, force that holds it, displacement, number of the free
/// field, area, whether it is rigid
template <int D>
using DashpotEntry = std::tuple<Matrix<D>, Matrix<D>, Vector<D>, Vector<D>, Index, double, bool>;

/// @throws InputError in axial symmetry, a node to the left of the axis
template <class G>
void require_radii(const Mesh<G::dim>& mesh)
{
  if constexpr (G::has_hoop)
    for (const auto& point : mesh.points)
      if (point[0] < 0)
        throw InputError("points has a node at the radius x = " + number_text(point[0]) +
                         " m, expected 0 or more in axial symmetry, where the axis is x = 0");
}

template <class G, int D = G::dim>
std::unique_ptr<Model<G>> new_model(const Mesh<D>& mesh, std::vector<Law> laws, std::vector<Index> velocity_fields,
                                    std::uintptr_t comm)
{
  require_radii<G>(mesh);
  auto model = std::make_unique<Model<G>>();
  model->mesh = mesh;
  model->exchange = make_node_exchange(mesh, communicator(comm));
  set_laws(*model, std::move(laws), std::move(velocity_fields));
  set_supports(*model, {});
  return model;
}

template <class G, int D = G::dim>
void set_free_field(Model<G>& model, std::size_t number, const std::vector<double>& heights,
                    const std::vector<double>& times, const py::array& velocity, const py::array& traction)
{
  const auto m = static_cast<py::ssize_t>(times.size()), n = static_cast<py::ssize_t>(heights.size());
  check_array<double>("velocity", velocity, {m, n, D});
  check_array<double>("traction", traction, {m, n, D});
  const auto v = values<double>(velocity), t = values<double>(traction);
  std::vector<typename FreeField<D>::State> states(times.size() * heights.size());
  for (std::size_t i = 0; i < states.size(); ++i)
    for (int a = 0; a < D; ++a)
    {
      states[i].velocity[a] = v[i * D + a];
      states[i].traction[a] = t[i * D + a];
    }
  auto& grounds = model.fields.front().free_fields;
  grounds.resize(std::max(grounds.size(), number + 1));
  grounds[number] = {heights, times, std::move(states)};
}

/// What each owned cell integrated [N m] in the last step, the sum over velocity fields: (cells, n), components of a
/// stress, of which that across the plane is left out.
/// @pre the model is prepared
/// @note Collective where stresses are integrated over whole cells
template <class G, int D = G::dim>
py::array_t<double> integrated_stresses(Model<G>& model)
{
  constexpr auto n = static_cast<std::size_t>(n_stress<D>);
  std::vector<double> sums(static_cast<std::size_t>(model.mesh.owned_cells) * n, 0.0);
  for (auto& field : model.fields)
  {
    begin_integration(model.mesh, model.exchange, model.particles, model.order.runs, field);
    for (Index c = 0; c < model.mesh.owned_cells; ++c)
    {
      if (!(field.moments[c].mass > 0))
        continue;
      const Working<G> stress = integrated_stress(model.mesh, field, c);
      for (int k = 0; k < n_symmetric<D>; ++k)
        sums[static_cast<std::size_t>(c) * n + static_cast<std::size_t>(stress_component<D>[k])] += stress[k];
    }
  }
  return py::array_t<double>({static_cast<py::ssize_t>(model.mesh.owned_cells), static_cast<py::ssize_t>(n)},
                             sums.data());
}

template <class G, int D = G::dim>
void bind_model(py::module_& m, const std::string& suffix)
{
  using M = Model<G>;
  py::class_<M>(m, ("Model" + suffix).c_str())
      .def(py::init(&new_model<G>))
      .def("seed_cells",
           [](M& model, std::optional<Index> tag, int per_cell, Index material, double density, GlobalIndex first_id)
           {
             reset_cells(model);
             changed(model);
             return seed_cells<G>(model.mesh, tag, per_cell, {material, density}, first_id, model.particles);
           })
      .def("seed_points",
           [](M& model, const py::array& points, const py::array& volumes, const py::array& ids, Index material,
              double density)
           {
             check_array<double>("points", points, {-1, D});
             check_array<double>("volumes", volumes, {points.shape(0)});
             check_array<GlobalIndex>("ids", ids, {points.shape(0)});
             reset_cells(model);
             changed(model);
             return seed_points<D>(model.mesh, values<double>(points), values<double>(volumes),
                                   values<GlobalIndex>(ids), {material, density}, model.particles);
           })
      .def("load_facets",
           [](M& model, Index facet_tag, const Vector<D>& traction)
           {
             reset_cells(model);
             model.ready = false;
             return load_facets<G>(model.mesh, facet_tag, traction, model.particles);
           })
      .def("set_supports",
           [](M& model, const std::vector<std::tuple<Index, bool, std::array<std::optional<double>, D>>>& conditions)
           {
             std::vector<SupportRequest<D>> requests;
             for (const auto& [tag, whole, components] : conditions)
             {
               Vector<D> vector;
               for (int a = 0; a < D; ++a)
                 vector[a] = components[a].value_or(std::numeric_limits<double>::quiet_NaN());
               requests.push_back({tag, whole, vector});
             }
             set_supports(model, requests);
           })
      .def("split_phases", &split_phases<G>)
      .def_property_readonly("has_two_phases", &has_two_phases<G>)
      .def("set_impervious", 
           [](M& model, const std::vector<Index>& facet_tags, const std::vector<Index>& supplied_tags)
           { set_impervious(model, facet_tags, supplied_tags); })
      .def("set_absorbing_sides",
           [](M& model, const std::vector<std::tuple<Index, double, double, double, Index>>& given)
           {
             std::vector<AbsorbingSide> sides;
             for (const auto& [tag, normal, shear, thickness, free_field] : given)
               sides.push_back({tag, normal, shear, thickness, free_field});
             reset_cells(model);
             set_absorbing_sides(model, sides, gravity_at(model, model.time));
           })
      .def("set_incoming_wave",
           [](M& model, const std::vector<double>& times, const std::vector<double>& velocities,
              const Vector<D>& direction) { model.fields.front().incoming = {times, velocities, direction}; })
      .def("set_free_field", &set_free_field<G>)
      .def("dashpots",
           [](const M& model) // by the place of the node, since its number depends on the partition
           {
             std::map<Vector<D>, std::vector<DashpotEntry<D>>> entries;
             for (const auto& d : model.fields.front().dashpots)
               if (model.exchange.owned[d.node]) // springs of nodes that only ghost cells have do not move
                 entries[model.mesh.points[d.node]].push_back(
                     {d.damping, d.stiffness, d.held, d.displacement, d.free_field, d.area, d.is_rigid});
             return std::vector(entries.begin(), entries.end());
           })
      .def("set_dashpots",
           [](M& model, const std::vector<std::pair<Vector<D>, std::vector<DashpotEntry<D>>>>& given)
           {
             const std::map<Vector<D>, std::vector<DashpotEntry<D>>> entries(given.begin(), given.end());
             auto& dashpots = model.fields.front().dashpots;
             dashpots.clear();
             for (Index i = 0; i < model.mesh.n_nodes(); ++i)
               if (const auto found = entries.find(model.mesh.points[i]); found != entries.end())
                 for (const auto& [damping, stiffness, held, displacement, free_field, area, is_rigid] : found->second)
                   dashpots.push_back({i, damping, stiffness, held, displacement, free_field, area, is_rigid});
           })
      .def("set_partition", [](M& model, const Mesh<D>& mesh, const py::array& owners)
           { set_partition(model, mesh, values<std::int64_t>(owners)); })
      .def("unbalanced_at",
           [](M& model, const std::vector<GlobalIndex>& nodes)
           { return unbalanced_at(model, nodes, gravity_at(model, model.time)); })
      .def("set_far_field",
           [](M& model, const std::vector<GlobalIndex>& nodes, const py::array& stiffness, const py::array& mass,
              const py::array& held, const py::array& displacement)
           {
             const auto n = static_cast<py::ssize_t>(nodes.size());
             reset_cells(model);
             check_array<double>("stiffness", stiffness, {n * D, n * D});
             check_array<double>("mass", mass, {n, D, D});
             check_array<double>("held", held, {n, D});
             check_array<double>("displacement", displacement, {n, D});
             set_far_field(model, nodes, values<double>(stiffness), values<double>(mass), values<double>(held),
                           values<double>(displacement));
           })
      .def_property_readonly("far_field_displacement",
                             [](const M& model) { return copied(model.fields.front().far_field.displacement); })
      .def_readwrite("water", &M::water)
      .def_readwrite("outflow_tags", &M::outflow_tags)
      .def_readwrite("gravity", &M::gravity)
      .def_readwrite("gravity_ramp", &M::gravity_ramp)
      .def_readwrite("time", &M::time)
      .def_property(
          "last_integration", [](const M& model) { return model.fields.front().integration.kind; },
          [](M& model, Integration kind)
          {
            for (auto& field : model.fields)
              field.integration.kind = kind;
          })
      .def_property_readonly("size", [](const M& model) { return model.particles.size(); })
      .def_property_readonly("steps", [](const M& model) { return model.totals.steps; })
      .def_property_readonly("sorts", [](const M& model) { return model.totals.sorts; })
      .def_property_readonly("last_dt", [](const M& model) { return model.last.dt; })
      .def_property_readonly("node_positions",
                             [](const M& model) {
                               return py::array_t<double>({static_cast<py::ssize_t>(model.mesh.points.size()), py::ssize_t{D}},
                                                          model.mesh.points.data()->data());
                             })
      .def_property_readonly("cell_volumes",
                             [](const M& model)
                             {
                               std::vector<double> volumes;
                               for (const auto& shape : model.mesh.shapes)
                                 volumes.push_back(cell_volume<G>(shape));
                               return copied(volumes);
                             })
      .def_property_readonly("has_moved_cells", [](const M& model) { return !model.moved_cells.initial_points.empty(); })
      .def("critical_time_step",
           [](M& model)
           {
             prepare(model);
             begin_members(model);
             return critical_with_members(critical_time_step(model), squared_frequency_of_members(model));
           })
      .def("critical_particle",
           [](M& model)
           {
             prepare(model);
             const CriticalParticle found = critical_particle(model);
             return std::tuple(found.particle, found.altitude, std::sqrt(found.squared_time));
           })
      .def("out_of_balance",
           [](M& model, const Vector<D>& gravity, Integration integration, bool nmd)
           {
             prepare(model);
             choose_forces(model, integration, nmd ? Averages::of_steps : Averages::none);
             choose_groups(model, nmd);
             stand_water(model, model.time, gravity);
             map_to_nodes(model);
             begin_members(model);
             for (auto& field : model.fields)
               add_member_forces(model, field);
             return out_of_balance(model, gravity);
           })
      .def("integrated_stress",
           [](M& model)
           {
             prepare(model);
             return integrated_stresses(model);
           })
      .def("averaged_over_nodes",
           [](M& model, const py::array_t<double, py::array::c_style | py::array::forcecast>& values)
           {
             const auto size = static_cast<std::size_t>(values.size());
             const std::vector<double> averaged = averaged_over_nodes(model, std::span(values.data(), size));
             return py::array_t<double>(static_cast<py::ssize_t>(size), averaged.data());
           })
      .def("run_explicit",
           [](M& model, const ExplicitOptions& options, const RunOptions& run)
           {
             py::gil_scoped_release release;
             return run_explicit(model, options, run);
           })
      .def("diagnostics",
           [](M& model)
           {
             prepare(model);
             return as_dict(diagnostics(model));
           })
      .def("add_field",
           [](M& model, const std::string& name, const std::string& unit, const std::string& meaning, int components,
              double initial) {
             add_field(model.particles, {name, unit, meaning, initial, {}}, components);
           })
      .def("particle_schedule", [](const M& model) { return particle_schedule(model.particles); })
      .def_static("default_particle_schedule", [] { return particle_schedule(Particles<D>{}); })
      .def_static("nodal_schedule",
                  []
                  {
                    py::list entries;
                    for_each_nodal_field(VelocityField<G>{},
                                         [&](const Field& field, const double*, std::size_t components, std::size_t)
                                         { entries.append(described(field, components, false)); });
                    return entries;
                  })
      .def("column", &column<G>)
      .def("copied_fields", &copied_fields<G>, py::arg("names"), py::arg("single"), py::arg("padded"))
      .def("require_fields",
           [](const M& model, const std::vector<std::string>& particles, const std::vector<std::string>& nodes)
           {
             for_each_view(model.particles, particles, [](auto&&...) {});
             for (const std::string& name : nodes)
               require_nodal_field(model, name);
           })
      .def("row_numbers", &row_numbers<G>)
      .def("find_rows", &find_rows<G>)
      .def("set_column", &set_column<G>)
      .def("place_particles",
           [](M& model, const py::array& positions)
           {
             check_array<double>("position", positions, {static_cast<py::ssize_t>(model.particles.size()), D});
             reset_cells(model);
             place_particles<G>(model, values<double>(positions));
           })
      .def("rest_cells",
           [](M& model, const py::array& chosen)
           {
             check_array<std::uint8_t>("chosen", chosen, {static_cast<py::ssize_t>(model.mesh.owned_cells)});
             reset_cells(model);
             rest_cells(model, values<std::uint8_t>(chosen));
           })
      .def("convert_cells",
           [](M& model, const py::array& chosen)
           {
             check_array<std::uint8_t>("chosen", chosen, {static_cast<py::ssize_t>(model.mesh.owned_cells)});
             prepare(model);
             convert_cells(model, values<std::uint8_t>(chosen));
           })
      .def("convert_failing",
           [](M& model, const Conversion& conversion)
           {
             prepare(model);
             convert_failing(model, conversion);
           })
      .def("convert_near_surfaces",
           [](M& model, double ahead)
           {
             prepare(model);
             convert_near_surfaces(model, ahead);
           })
      .def_property_readonly("has_resting_cells", [](const M& model) { return model.particles.resting.present; })
      .def_property_readonly("converted_cells", [](const M& model) { return model.totals.converted_cells; })
      .def("remove_particles",
           [](M& model, const py::array& rows)
           {
             check_array<Index>("rows", rows, {-1}); // sorted, without repetition, of particles that are there
             remove<D>(model.particles, values<Index>(rows));
             changed(model);
           })
      .def("set_materials",
           [](M& model, const py::array& numbers)
           {
             check_array<Index>("material", numbers, {static_cast<py::ssize_t>(model.particles.material.size())});
             const auto in = values<Index>(numbers);
             model.particles.material.assign(in.begin(), in.end());
             changed(model);
           })
      .def("nodal", [](const M& model, const std::string& name, std::size_t velocity_field)
           { return copied_field<double>(nodal_field(model, name, velocity_field)); })
      .def("phase_seconds",
           [](const M& model)
           {
             py::dict seconds;
             for (std::size_t k = 0; k < phase_names.size(); ++k)
               seconds[phase_names[k]] = model.phase_seconds[k];
             return seconds;
           })
      .def("bytes_per_particle", [](const M& model) { return bytes_per_particle(model.particles); });
}
} // namespace

void bind_models(py::module_& m)
{
  bind_model<PlaneStrain>(m, "2");
  bind_model<Axisymmetric>(m, "Axisymmetric");
  bind_model<Solid>(m, "3");
}
} // namespace mpm::python
