#include "python/bindings.h"

#include "contact/clearance.h"
#include "contact/collisions.h"
#include "model/contacts.h"
#include "python/arrays.h"

#include <algorithm>

namespace mpm::python
{
namespace
{
namespace py = pybind11;

template <int D>
void bind_surfaces(py::module_& m, const std::string& suffix)
{
  using V = Vector<D>;
  py::class_<Plane<D>>(m, ("Plane" + suffix).c_str())
      .def(py::init(
          [](const V& point, const V& normal) {
            return Plane<D>{point, normal};
          }));
  py::class_<Ball<D>>(m, ("Ball" + suffix).c_str())
      .def(py::init(
          [](const V& centre, double radius) {
            return Ball<D>{centre, radius};
          }));
  py::class_<Box<D>>(m, ("Box" + suffix).c_str())
      .def(py::init(
          [](const V& lower, const V& upper) {
            return Box<D>{lower, upper};
          }));
}

/// Signed distances of points, one to a row.
template <int D>
void bind_distances(py::module_& m)
{
  m.def("distances",
        [](const Surface<D>& surface, const py::array_t<double, py::array::c_style>& points)
        {
          const py::ssize_t n = points.shape(0);
          py::array_t<double> values(n);
          for (py::ssize_t k = 0; k < n; ++k)
          {
            Vector<D> x;
            std::copy_n(points.data(k), D, x.begin());
            values.mutable_at(k) = distance<D>(surface, x).value;
          }
          return values;
        });
}

template <int N>
using GivenHistory = std::tuple<std::vector<double>, std::vector<Vector<N>>>; // times, values

template <int N>
History<N> history_of(const GivenHistory<N>& given)
{
  return {std::get<0>(given), std::get<1>(given)};
}

template <int D>
void bind_body(py::module_& m, const std::string& suffix)
{
  py::class_<RigidBody<D>>(m, ("RigidBody" + suffix).c_str())
      .def(py::init(
          [](const Vector<D>& centre, const GivenHistory<D>& velocity, const GivenHistory<3>& spin,
             const std::array<int, D>& drive, bool rotates, double mass, const Vector<3>& inertia,
             const GivenHistory<D>& force, double fastest, const Vector<D>& velocity_now, const Vector<3>& spin_now)
          {
            RigidBody<D> body{};
            body.centre = centre;
            body.prescribed_velocity = history_of<D>(velocity);
            body.prescribed_spin = history_of<3>(spin);
            for (std::size_t i = 0; i < D; ++i)
              body.drive[i] = static_cast<Drive>(drive[i]);
            body.rotates = rotates;
            body.mass = mass;
            body.inertia = inertia;
            body.force = history_of<D>(force);
            body.fastest = fastest;
            body.velocity = velocity_now;
            set_spin(spin_now, body);
            return body;
          }));
}

/// What the soil of all ranks does to a surface, and how it moves.
template <class G, int D = G::dim>
py::dict contact_state(const Model<G>& model, std::size_t number)
{
  const Contact<D>& contact = model.contacts.at(number);
  struct
  {
    Reaction<D> reaction;
    Vector<D> impulse;
  } sums{contact.reaction, contact.impulse};
  MPI_Allreduce(MPI_IN_PLACE, &sums, sizeof(sums) / sizeof(double), MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  const RigidBody<D>& body = contact.body;
  py::dict state;
  state["force"] = sums.reaction.force;
  state["moment"] = sums.reaction.moment;
  state["impulse"] = sums.impulse;
  state["normal"] = sums.reaction.normal;
  state["area"] = sums.reaction.area;
  state["sticking"] = sums.reaction.sticking;
  state["energy"] = sums.reaction.energy;
  // Of explicit steps: the mean over the mass that touches.
  const double spring = contact.penalty * sums.reaction.pressing;
  state["penetration"] = spring > 0 ? sums.reaction.normal * contact.stiff_step * contact.stiff_step / spring : 0;
  state["collision_impulse"] = body.collision_impulse;
  state["displacement"] = body.displacement;
  state["velocity"] = body.velocity;
  state["rotation"] = body.rotation;
  state["angle"] = body.angle;
  state["spin"] = body.spin;
  state["kinetic_energy"] = kinetic_energy(body);
  return state;
}

/// What two bodies do to each other on all ranks.
template <class G, int D = G::dim>
py::dict field_contact_state(const Model<G>& model, std::size_t number)
{
  const FieldContact<D>& contact = model.field_contacts.at(number);
  struct
  {
    Vector<D> force, impulse;
    double nodes;
  } sums{contact.force, contact.impulse, 0};
  for (const auto& at : contact.touching)
    sums.nodes += model.exchange.owned[at.node];
  MPI_Allreduce(MPI_IN_PLACE, &sums, sizeof(sums) / sizeof(double), MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  py::dict state;
  state["force"] = sums.force;
  state["impulse"] = sums.impulse;
  state["nodes"] = static_cast<std::int64_t>(sums.nodes);
  return state;
}

/// Points, normals and forces of the nodes of this rank at which two bodies touch, each (n, D).
template <class G, int D = G::dim>
py::tuple touching_nodes(const Model<G>& model, std::size_t number)
{
  std::vector<std::array<Vector<D>, 3>> rows;
  for (const auto& at : model.field_contacts.at(number).touching)
    if (model.exchange.owned[at.node])
      rows.push_back({model.mesh.points[at.node], at.normal, at.force});
  const auto column = [&rows](std::size_t k)
  {
    py::array_t<double> values({rows.size(), static_cast<std::size_t>(D)});
    for (std::size_t i = 0; i < rows.size(); ++i)
      std::ranges::copy(rows[i][k], values.mutable_data() + i * D);
    return values;
  };
  return py::make_tuple(column(0), column(1), column(2));
}

template <class G, int D = G::dim>
void bind_contacts_of(py::module_& m)
{
  m.def("smallest_gap",
        [](const Model<G>& model, const Surface<D>& surface) { return smallest_gap<G>(model, surface); });
  m.def("add_contact",
        [](Model<G>& model, const Surface<D>& surface, const py::array_t<double, py::array::c_style>& strength,
           double penalty, const RigidBody<D>& body, const std::string& slip, const std::string& bond)
        {
          Contact<D> contact{};
          contact.surface = surface;
          for (py::ssize_t k = 0; k < strength.shape(0); ++k)
            contact.resistances.push_back({strength.at(k, 0), strength.at(k, 1), strength.at(k, 2)});
          contact.penalty = penalty;
          contact.body = body;
          contact.slip = slip;
          contact.bond = bond;
          model.contacts.push_back(std::move(contact));
        });
  m.def("clear_contacts",
        [](Model<G>& model)
        {
          model.contacts.clear();
          model.collisions.clear();
          model.field_contacts.clear();
        });
  m.def("add_collision",
        [](Model<G>& model, std::size_t ball, std::size_t other, double friction, double restitution) {
          model.collisions.push_back({ball, other, friction, restitution});
        });
  m.def("distance_between", [](const Model<G>& model, std::size_t ball, std::size_t other)
        { return distance_between(model.contacts.at(ball), model.contacts.at(other)); });
  m.def("contact_state", &contact_state<G>);
  m.def("add_field_contact",
        [](Model<G>& model, Index first, Index second, double friction, double adhesion, const Surface<D>& interface) {
          model.field_contacts.push_back({first, second, friction, adhesion, interface, {}, {}, {}, {}, {}});
        });
  m.def("field_contact_state", &field_contact_state<G>);
  m.def("touching_nodes", &touching_nodes<G>);
}
} // namespace

void bind_contacts(py::module_& m)
{
  m.attr("near_reaches") = contact::near_reaches;
  bind_surfaces<2>(m, "2");
  bind_surfaces<3>(m, "3");
  bind_distances<2>(m);
  bind_distances<3>(m);
  bind_body<2>(m, "2");
  bind_body<3>(m, "3");
  py::class_<Polyline>(m, "Polyline2")
      .def(py::init(
          [](const std::vector<Vector<2>>& points, bool closed) {
            return Polyline{points, closed};
          }));
  py::class_<Revolved>(m, "Revolved3")
      .def(py::init(
          [](const Vector<3>& point, const Vector<3>& axis, const std::vector<Vector<2>>& section) {
            return Revolved{point, axis, {section, true}};
          }));
  py::class_<Triangles>(m, "Triangles3")
      .def(py::init(
          [](const py::array_t<double, py::array::c_style>& vertices,
             const py::array_t<Index, py::array::c_style>& triangles)
          {
            std::vector<Vector<3>> points(static_cast<std::size_t>(vertices.shape(0)));
            std::copy_n(vertices.data(), 3 * points.size(), points.empty() ? nullptr : points.front().data());
            std::vector<std::array<Index, 3>> corners(static_cast<std::size_t>(triangles.shape(0)));
            std::copy_n(triangles.data(), 3 * corners.size(), corners.empty() ? nullptr : corners.front().data());
            return make_triangles(std::move(points), std::move(corners));
          }));
  bind_contacts_of<PlaneStrain>(m);
  bind_contacts_of<Axisymmetric>(m);
  bind_contacts_of<Solid>(m);
}
} // namespace mpm::python
