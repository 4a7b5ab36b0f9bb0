#include "explicit/run.h"
#include "implicit/driven_bodies.h"
#include "implicit/pore_surface.h"
#include "implicit/pore_water.h"
#include "implicit/relaxation.h"
#include "implicit/stages.h"
#include "implicit/supported.h"
#include "python/arrays.h"
#include "python/bindings.h"

namespace mpm::python
{
namespace
{
/// An implicit step of a model, with its linear system.
template <class G, int D = G::dim>
struct Implicit
{
  Model<G>& model;
  ImplicitStep<G> step;
  ImplicitSystem<D> system;
  TangentEntries tangent;
  Relaxation<D> relaxation;
};

/// Result of a trial; where it failed, with the reason in words.
template <class G, int D = G::dim>
py::dict as_dict(const Implicit<G>& implicit, const TrialReport& report)
{
  using namespace py::literals;
  const auto& failure = implicit.step.failure;
  return py::dict("residual"_a = report.residual, "scale"_a = report.scale, "lost_water"_a = report.lost_water,
                  "plastic"_a = report.plastic, "failed"_a = report.failed,
                  "reason"_a = failure ? failure_text(implicit.model, *failure) : "");
}

/// Binds a matrix of the tangent: rows and columns of its entries, and their values.
template <class G>
void bind_matrix(py::class_<Implicit<G>>& bound, const std::string& name, BlockEntries TangentEntries::*matrix)
{
  bound.def((name + "_places").c_str(),
            [matrix](const Implicit<G>& i)
            {
              const auto [rows, columns] = places(i.tangent.*matrix);
              return py::make_tuple(copied(rows), copied(columns));
            });
  bound.def((name + "_values").c_str(), [matrix](const Implicit<G>& i) { return copied((i.tangent.*matrix).values); });
}

/// Vectors at this rank's nodes of the system, each followed by a number where pressures are unknowns.
template <class G>
py::array_t<double> unknowns(const Implicit<G>& implicit, const std::vector<Vector<G::dim>>& vectors,
                             const std::vector<double>& numbers, double factor)
{
  if (!implicit.step.pore.flows)
    return copied(owned_values<G::dim>(implicit.system, vectors));
  std::vector<double> values;
  for (Index node : implicit.system.owned)
  {
    values.insert(values.end(), vectors[node].begin(), vectors[node].end());
    values.push_back(implicit.step.pore.held[node] ? 0 : factor * numbers[node]);
  }
  return copied(values);
}

/// The opposite, for the iterate. Pressures that are prescribed, and supported velocities, become what they must be.
template <class G, int D = G::dim>
void set_unknowns(Implicit<G>& implicit, const py::array& array)
{
  const auto n = implicit.system.owned.size();
  const auto width = static_cast<std::size_t>(implicit.system.unknowns);
  check_array<double>("iterate", array, {static_cast<py::ssize_t>(n * width)});
  const auto in = values<double>(array);
  std::vector<double> vectors;
  auto& pore = implicit.step.pore;
  if (pore.flows)
    std::ranges::fill(pore.rate, 0.0);
  for (std::size_t k = 0; k < n; ++k)
  {
    vectors.insert(vectors.end(), &in[k * width], &in[k * width] + D);
    if (pore.flows)
      pore.rate[implicit.system.owned[k]] = pore.unit * in[k * width + D];
  }
  Model<G>& model = implicit.model;
  set_nodal<D>(model.exchange, implicit.system, vectors, model.fields.front().velocity);
  impose_supports(implicit.step, model.fields.front());
  if (!pore.flows)
    return;
  sum_shared(model.exchange, pore.rate);
  impose_pressures(implicit.step.dt, pore);
}

/// Coordinates of this rank's nodes of the system, (n, D).
template <class G, int D = G::dim>
py::array_t<double> owned_points(const Implicit<G>& implicit)
{
  const auto values = owned_values<D>(implicit.system, implicit.model.mesh.points);
  return copied(values).reshape({-1, D});
}

/// One vector of this rank's unknowns for each axis along which forces move a body, without supported directions. The
/// motion of a body does not move water: what it has of pressures is zero.
template <class G, int D = G::dim>
py::array_t<double> of_bodies(const Implicit<G>& implicit, std::vector<Vector<D>> DrivenAxis<D>::*nodal)
{
  std::vector<double> all;
  for (const DrivenAxis<D>& driven : implicit.step.bodies.axes)
    for (Index node : implicit.system.owned)
    {
      const Vector<D> v = product<D>(projector(implicit.system, node), (driven.*nodal)[static_cast<std::size_t>(node)]);
      all.insert(all.end(), v.begin(), v.end());
      all.resize(all.size() + static_cast<std::size_t>(implicit.system.unknowns - D));
    }
  return copied(all);
}

/// The bodies that forces move: their unknowns, balances and derivatives; see implicit/driven_bodies.h.
template <class G, int D = G::dim>
void bind_bodies(py::class_<Implicit<G>>& bound)
{
  using I = Implicit<G>;
  const auto numbers = [](double DrivenAxis<D>::*number)
  {
    return [number](const I& i)
    {
      std::vector<double> all;
      for (const DrivenAxis<D>& driven : i.step.bodies.axes)
        all.push_back(driven.*number);
      return copied(all);
    };
  };
  bound
      .def_property("body_velocity", numbers(&DrivenAxis<D>::velocity),
                    [](I& i, const std::vector<double>& velocity)
                    {
                      for (std::size_t k = 0; k < i.step.bodies.axes.size(); ++k)
                        i.step.bodies.axes[k].velocity = velocity.at(k);
                    })
      .def_property_readonly("body_residual", numbers(&DrivenAxis<D>::residual))
      .def_property_readonly("body_block", [](const I& i) { return copied(i.step.bodies.block); })
      .def_property_readonly("body_columns", [](const I& i) { return of_bodies<G, D>(i, &DrivenAxis<D>::column); })
      .def_property_readonly("body_rows", [](const I& i) { return of_bodies<G, D>(i, &DrivenAxis<D>::row); })
      .def_property_readonly("body_rows_by_strain",
                             [](const I& i)
                             {
                               std::vector<double> all;
                               const auto groups = static_cast<std::size_t>(i.system.groups.count);
                               for (const DrivenAxis<D>& driven : i.step.bodies.axes)
                                 for (Index node : i.system.owned)
                                 {
                                   const auto first =
                                       driven.row_by_strain.begin() +
                                       static_cast<std::ptrdiff_t>(groups * static_cast<std::size_t>(node));
                                   all.insert(all.end(), first, first + static_cast<std::ptrdiff_t>(groups));
                                 }
                               return copied(all);
                             });
}

template <class G, int D = G::dim>
void bind_implicit_step(py::module_& m, const std::string& suffix)
{
  using I = Implicit<G>;
  using Release = py::call_guard<py::gil_scoped_release>;
  py::class_<I> bound(m, ("ImplicitStep" + suffix).c_str());
  bound.def(py::init(
                [](Model<G>& model) {
                  return I{model, {}, {}, {}, {}};
                }),
            py::keep_alive<1, 2>())
      .def(
          "start",
          [](I& i, const ImplicitOptions& options, double dt)
          {
            start_step(i.model, i.step, options, dt);
            const bool changed = number_nodes(i.model.exchange, i.model.fields.front(), i.step, i.system);
            if (changed)
              i.tangent = {};
            return changed;
          },
          Release())
      .def(
          "trial",
          [](I& i, bool tangents)
          {
            py::gil_scoped_release release;
            const TrialReport report = find_residual(i.model, i.step, tangents);
            py::gil_scoped_acquire acquire;
            return as_dict(i, report);
          },
          py::arg("tangents") = false)
      .def(
          "assemble", [](I& i) { find_tangent(i.model.mesh, i.model.fields.front(), i.step, i.system, i.tangent); },
          Release())
      .def_property_readonly("has_surface", [](const I& i)
                             { return i.step.pore.drained && i.model.water && i.model.water->may_dry(); })
      .def(
          "revise_surface", [](I& i) { return revise_surface(i.model.mesh, i.model.exchange.comm, i.step); }, Release())
      .def(
          "start_second_stage", [](I& i) { start_second_stage(i.model, i.step); }, Release())
      .def(
          "displacement_error",
          [](const I& i) { return displacement_error(i.model.exchange, i.model.fields.front(), i.step); }, Release())
      .def_property_readonly("dt", [](const I& i) { return i.step.dt; })
      .def("start_relaxation",
           [](I& i, RelaxationKind kind)
           {
             py::gil_scoped_release release;
             i.relaxation = start_relaxation(i.model, i.step, kind);
             py::gil_scoped_acquire acquire;
             return as_dict(i, i.relaxation.report);
           })
      .def("relax",
           [](I& i, double tolerance, int most)
           {
             py::gil_scoped_release release;
             const int done = relax(i.model, i.step, i.relaxation, tolerance, most);
             py::gil_scoped_acquire acquire;
             return py::make_tuple(done, as_dict(i, i.relaxation.report));
           })
      .def(
          "finish",
          [](I& i)
          {
            const bool done = accept_step(i.model, i.step);
            const std::string why = done ? "" : failure_text(i.model, *i.model.failure);
            i.model.failure.reset();
            return why;
          },
          Release())
      .def_property_readonly("owned_nodes", [](const I& i) { return i.system.owned.size(); })
      .def_property_readonly("owned_means", [](const I& i) { return i.system.groups.count * i.system.owned.size(); })
      .def_property_readonly("total_nodes", [](const I& i) { return i.system.total; })
      .def_property_readonly("points", &owned_points<G>)
      .def_property_readonly("unknowns", [](const I& i) { return i.system.unknowns; })
      .def_property_readonly("residual", [](const I& i)
                             { return unknowns<G>(i, i.step.residual, i.step.pore.content, i.step.pore.unit); })
      .def_property(
          "iterate",
          [](const I& i)
          { return unknowns<G>(i, i.model.fields.front().velocity, i.step.pore.rate, 1 / i.step.pore.unit); },
          &set_unknowns<G>);
  bind_bodies(bound);
  bind_matrix(bound, "stiffness", &TangentEntries::stiffness);
  bind_matrix(bound, "volumetric_force", &TangentEntries::volumetric_force);
  bind_matrix(bound, "volumetric_strain", &TangentEntries::volumetric_strain);
  bind_matrix(bound, "mean_stress", &TangentEntries::mean_stress);
  bind_matrix(bound, "mean_stress_by_strain", &TangentEntries::mean_stress_by_strain);
}
} // namespace

void bind_implicit(py::module_& m)
{
  py::enum_<RelaxationKind>(m, "RelaxationKind")
      .value("RICHARDSON", RelaxationKind::richardson)
      .value("LOCAL", RelaxationKind::local)
      .value("KINETIC", RelaxationKind::kinetic)
      .value("VISCOUS", RelaxationKind::viscous);
  py::class_<GhostOptions>(m, "GhostOptions")
      .def(py::init<>())
      .def_readwrite("stiffness", &GhostOptions::stiffness)
      .def_readwrite("mass", &GhostOptions::mass)
      .def_readwrite("filled", &GhostOptions::filled);
  py::class_<ImplicitOptions>(m, "ImplicitOptions")
      .def(py::init<>())
      .def_readwrite("damping", &ImplicitOptions::damping)
      .def_readwrite("mass_damping", &ImplicitOptions::mass_damping)
      .def_readwrite("pic", &ImplicitOptions::pic)
      .def_readwrite("nmd", &ImplicitOptions::nmd)
      .def_readwrite("average_stress", &ImplicitOptions::average_stress)
      .def_readwrite("as_elements", &ImplicitOptions::as_elements)
      .def_readwrite("integration", &ImplicitOptions::integration)
      .def_readwrite("ghost", &ImplicitOptions::ghost)
      .def_readwrite("at_rest", &ImplicitOptions::at_rest)
      .def_readwrite("hold_positions", &ImplicitOptions::hold_positions)
      .def_readwrite("count_displacement", &ImplicitOptions::count_displacement)
      .def_readwrite("load_fraction", &ImplicitOptions::load_fraction)
      .def_readwrite("second_order", &ImplicitOptions::second_order)
      .def_readwrite("quasi_static", &ImplicitOptions::quasi_static);
  bind_implicit_step<PlaneStrain>(m, "2");
  bind_implicit_step<Axisymmetric>(m, "Axisymmetric");
  bind_implicit_step<Solid>(m, "3");
}
} // namespace mpm::python
