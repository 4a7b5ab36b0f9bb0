#include "python/bindings.h"

#include "model/contacts.h"

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

/// Over all ranks: the force and the impulse [N, N s], the moment about z in two dimensions or about the axes [N m],
/// and the displacement [m].
template <class G, int D = G::dim>
py::tuple contact_state(const Model<G>& model, std::size_t number)
{
  const Contact<D>& contact = model.contacts.at(number);
  std::array<double, 2 * D + 3> sums;
  std::copy_n(contact.force.begin(), D, sums.begin());
  std::copy_n(contact.impulse.begin(), D, sums.begin() + D);
  std::copy_n(contact.moment.begin(), 3, sums.begin() + 2 * D);
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<int>(sums.size()), MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  const auto part = [&sums](std::size_t first, std::size_t last)
  { return std::vector<double>(sums.data() + first, sums.data() + last); };
  return py::make_tuple(part(0, D), part(D, 2 * D), part(D == 2 ? 2 * D + 2 : 2 * D, 2 * D + 3),
                        displacement<D>(contact.motion, contact.start, model.time));
}

template <class G, int D = G::dim>
void bind_contacts_of(py::module_& m)
{
  m.def("smallest_gap",
        [](const Model<G>& model, const Surface<D>& surface) { return smallest_gap<G>(model.particles, surface); });
  m.def("add_contact",
        [](Model<G>& model, const Surface<D>& surface, double friction, double penalty,
           const std::vector<double>& times, const std::vector<Vector<D>>& velocities, double start,
           const Vector<D>& reference, const std::string& slip)
        {
          Contact<D> contact{};
          contact.surface = surface;
          contact.friction = friction;
          contact.penalty = penalty;
          contact.motion = {times, velocities};
          contact.start = start;
          contact.reference = reference;
          contact.slip = slip;
          model.contacts.push_back(std::move(contact));
        });
  m.def("clear_contacts", [](Model<G>& model) { model.contacts.clear(); });
  m.def("contact_state", &contact_state<G>);
}
} // namespace

void bind_contacts(py::module_& m)
{
  bind_surfaces<2>(m, "2");
  bind_surfaces<3>(m, "3");
  py::class_<Polyline>(m, "Polyline2")
      .def(py::init(
          [](const std::vector<Vector<2>>& points, bool closed) {
            return Polyline{points, closed};
          }));
  bind_contacts_of<PlaneStrain>(m);
  bind_contacts_of<Axisymmetric>(m);
  bind_contacts_of<Solid>(m);
}
} // namespace mpm::python
