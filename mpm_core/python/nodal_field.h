#pragma once
/// @file
/// Nodal fields of a model by name.

#include "io/series.h"
#include "model/model.h"

namespace mpm::python
{
/// The first value, or any where there is none.
template <class Values>
const auto& first_of(const Values& values)
{
  static const typename Values::value_type none{};
  return values.empty() ? none : values[0];
}

/// @throws InputError for a name that no nodal field has
inline void require_nodal_field(const std::string& name)
{
  for (const char* known : {"velocity", "acceleration", "internal_force", "mass"})
    if (name == known)
      return;
  throw InputError("nodal field is '" + name + "', expected velocity, acceleration, internal_force or mass");
}

/// A nodal field of the last step, where it is.
/// @throws InputError for another name than those above, and before the first step
template <int D>
OutputField nodal_field(const Model<D>& model, const std::string& name)
{
  require_nodal_field(name);
  const auto& work = model.work;
  if (!work.ready)
    throw InputError("nodal values of '" + name + "' are there only after a step or a report");
  OutputField field{name, work.nodes.size(), {}};
  const auto add = [&](const auto& first, std::size_t components, std::size_t bytes_apart)
  {
    for (std::size_t k = 0; k < components; ++k)
      field.columns.push_back({&first + k, bytes_apart / sizeof(double)});
  };
  static_assert(sizeof(NodeSums<D>) % sizeof(double) == 0);
  if (name == "velocity")
    add(first_of(work.velocity)[0], D, sizeof(Vector<D>));
  else if (name == "acceleration")
    add(first_of(work.acceleration)[0], D, sizeof(Vector<D>));
  else if (name == "internal_force")
    add(first_of(work.nodes).internal[0], D, sizeof(NodeSums<D>));
  else
    add(first_of(work.nodes).mass, 1, sizeof(NodeSums<D>));
  return field;
}
} // namespace mpm::python
