#include "python/bindings.h"

#include "model/bond.h"
#include "model/member_forces.h"
#include "model/members.h"

#include <pybind11/numpy.h>

namespace mpm::python
{
namespace
{
namespace py = pybind11;

/// As `_properties` of mpm_core/member_methods.py orders them.
MemberProperties properties_of(const std::array<double, 9>& given)
{
  return {given[0], given[1], given[2], given[3], given[4], given[5], given[6] != 0, given[7] != 0, given[8] != 0};
}

template <int D>
py::dict state_of(const Member<D>& member)
{
  py::dict state;
  state["positions"] = member.positions;
  state["initial_lengths"] = member.initial_lengths;
  state["free_lengths"] = member.free_lengths;
  state["free_angles"] = member.free_angles;
  state["axial_force"] = member.axial_force;
  state["moments"] = member.moments;
  state["cells"] = member.cells;
  state["is_in_soil"] = std::vector<int>(member.is_in_soil.begin(), member.is_in_soil.end());
  return state;
}

/// @throws InputError lists whose lengths do not fit
template <int D>
Member<D> member_of(const std::string& name, const MemberProperties& properties, const py::dict& state)
{
  Member<D> member{};
  member.name = name;
  member.properties = properties;
  member.positions = state["positions"].cast<std::vector<Vector<D>>>();
  member.initial_lengths = state["initial_lengths"].cast<std::vector<double>>();
  member.free_lengths = state["free_lengths"].cast<std::vector<double>>();
  member.free_angles = state["free_angles"].cast<std::vector<double>>();
  member.axial_force = state["axial_force"].cast<std::vector<double>>();
  member.moments = state["moments"].cast<std::vector<double>>();
  member.cells = state["cells"].cast<std::vector<GlobalIndex>>();
  const auto flags = state["is_in_soil"].cast<std::vector<int>>();
  member.is_in_soil.assign(flags.begin(), flags.end());
  const std::size_t n = member.positions.size(), segments = member.initial_lengths.size();
  const std::size_t bends = member.moments.size();
  if (n < 2 || segments != n - 1 || member.free_lengths.size() != segments || member.axial_force.size() != segments ||
      (bends != 0 && bends != n - 2) || member.free_angles.size() != bends || member.is_in_soil.size() != n ||
      member.cells.size() != n)
    throw InputError("the state of a structural member has lists whose lengths do not fit one another");
  member.hosts.resize(n);
  return member;
}

template <class G, int D = G::dim>
void bind_members_of(py::module_& m)
{
  m.def("install_member",
        [](Model<G>& model, const std::string& name, const std::array<double, 9>& properties,
           const std::vector<Vector<D>>& positions, const std::vector<double>& axial_force,
           const std::vector<double>& moments)
        {
          model.members.push_back(make_member<D>(name, properties_of(properties), positions, axial_force, moments));
          try
          {
            begin_members(model, true);
          }
          catch (const RunError& error)
          {
            model.members.pop_back();
            throw InputError(error.what());
          }
        });
  m.def("restore_member",
        [](Model<G>& model, const std::string& name, const std::array<double, 9>& properties, const py::dict& state)
        { model.members.push_back(member_of<D>(name, properties_of(properties), state)); });
  m.def("member_state", [](const Model<G>& model, std::size_t number) { return state_of(model.members.at(number)); });
  m.def("clear_members", [](Model<G>& model) { model.members.clear(); });
}
} // namespace

void bind_members(py::module_& m)
{
  m.def("bond_strengths", &bond_strengths);
  m.def("forces_with_slip",
        [](const std::vector<double>& force, const std::vector<double>& stiffness, const std::vector<double>& least,
           const std::vector<double>& largest, const std::vector<double>& bond_strength)
        {
          const std::vector<double> found = forces_with_slip({force, stiffness, least, largest, bond_strength});
          return py::array_t<double>(static_cast<py::ssize_t>(found.size()), found.data());
        });
  bind_members_of<PlaneStrain>(m);
  bind_members_of<Axisymmetric>(m);
  bind_members_of<Solid>(m);
}
} // namespace mpm::python
