#pragma once
/// @file
/// Nodal fields of a model by name.

#include "model/model.h"
#include "python/field_views.h"

namespace mpm::python
{
/// The one schedule of the nodal fields of a velocity field: calls f(field, first value of a node, components, bytes
/// from node to node).
template <class G, class F, int D = G::dim>
void for_each_nodal_field(const VelocityField<G>& velocity_field, F&& f)
{
  static const Vector<D> no_vector{};
  static const NodeSums<D> no_sums{};
  const auto first = [](const auto& values, const auto& none) -> const auto&
  {
    return values.empty() ? none : values[0];
  };
  const NodeSums<D>& sums = first(velocity_field.nodes, no_sums);
  f(Field{"velocity", "m/s", "Velocity v_i that moves and strains the particles"},
    first(velocity_field.velocity, no_vector).data(), D, sizeof(Vector<D>));
  f(Field{"acceleration", "m/s2", "Acceleration a_i"}, first(velocity_field.acceleration, no_vector).data(), D,
    sizeof(Vector<D>));
  f(Field{"internal_force", "N", "f_int,i of (14), per metre of thickness in plane strain"}, sums.internal.data(), D,
    sizeof(NodeSums<D>));
  f(Field{"mass", "kg", "Lumped mass m_i of (11), per metre of thickness in plane strain"}, &sums.mass, 1,
    sizeof(NodeSums<D>));
}

/// @throws InputError for a name that no nodal field has
template <class G, int D = G::dim>
void require_nodal_field(const Model<G>& model, const std::string& name)
{
  bool exists = false;
  std::string known;
  for_each_nodal_field(model.fields.front(),
                       [&](const Field& field, auto...)
                       {
                         exists = exists || field.name == name;
                         known += (known.empty() ? "" : ", ") + std::string(field.name);
                       });
  if (!exists)
    throw InputError("nodal field is '" + name + "', expected " + known);
}

/// A nodal field of the last step, where it is.
/// @throws InputError for a name that no nodal field has, and before the first step
template <class G, int D = G::dim>
FieldView nodal_field(const Model<G>& model, const std::string& name, std::size_t velocity_field = 0)
{
  require_nodal_field(model, name);
  if (velocity_field >= model.fields.size())
    throw InputError("velocity_field is " + std::to_string(velocity_field) + ", expected 0 to " +
                     std::to_string(model.fields.size() - 1));
  const VelocityField<G>& nodes = model.fields[velocity_field];
  if (!model.ready)
    throw InputError("nodal values of '" + name + "' exist only after a step or a report");
  FieldView found{name, nodes.nodes.size(), {}};
  for_each_nodal_field(nodes,
                       [&](const Field& field, const double* first, std::size_t components, std::size_t bytes_apart)
                       {
                         if (field.name == name)
                           for (std::size_t k = 0; k < components; ++k)
                             found.components.push_back({first + k, bytes_apart / sizeof(double)});
                       });
  return found;
}
} // namespace mpm::python
