#include "io/particle_fields.h"

#include <algorithm>

namespace mpm::io
{
namespace
{
/// A field of the list of columns; without columns where there is none of that name.
template <int D>
OutputField real_field(const Particles<D>& particles, const std::string& name)
{
  OutputField field{name, particles.id.size(), {}};
  for_each_column(particles,
                  [&](std::string_view of, int, const auto& column)
                  {
                    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(column)>, Column>)
                      if (name == of)
                        field.columns.push_back({column.data()});
                  });
  return field;
}

template <int D>
OutputField named_field(const Particles<D>& particles, const std::string& name)
{
  if (name == "displacement")
  {
    OutputField field{name, particles.id.size(), {}};
    for (int i = 0; i < D; ++i)
      field.columns.push_back({particles.position[i].data(), 1, particles.initial_position[i].data()});
    return field;
  }
  if (name == "plastic_strain" && !particles.state.empty())
    return {name, particles.id.size(), {{particles.state[0].data()}}};
  return real_field(particles, name);
}

template <int D>
bool add_index_field(const Particles<D>& particles, const std::string& name, std::vector<OutputIndexField>& fields)
{
  const std::size_t before = fields.size();
  for_each_column(particles,
                  [&](std::string_view of, int, const auto& column)
                  {
                    if constexpr (!std::is_same_v<std::remove_cvref_t<decltype(column)>, Column>)
                      if (name == of)
                        fields.push_back({name, std::span(column)});
                  });
  return fields.size() > before;
}
} // namespace

template <int D>
ParticleFields particle_fields(const Particles<D>& particles, const std::vector<std::string>& names)
{
  ParticleFields all{real_field(particles, "position"), {}, {}};
  for (const std::string& name : names)
  {
    if (name == "position" || add_index_field(particles, name, all.index_fields))
      continue;
    all.fields.push_back(named_field(particles, name));
    if (all.fields.back().columns.empty())
      throw InputError("particle field is '" + name + "', which does not exist");
    for_each_field(particles,
                   [&](const Field& field, const auto& columns)
                   {
                     if (field.name == name && !is_present(columns))
                       throw InputError("particle field is '" + name + "', but no particle carries one");
                   });
  }
  return all;
}

template ParticleFields particle_fields(const Particles<2>&, const std::vector<std::string>&);
template ParticleFields particle_fields(const Particles<3>&, const std::vector<std::string>&);
} // namespace mpm::io
