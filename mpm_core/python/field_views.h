#pragma once
/// @file
/// Fields of particles and nodes by name, where their values are.

#include "particles/particles.h"
#include "python/arrays.h"

#include <variant>

namespace mpm::python
{
/// One component of a field: every `stride`-th number from `first` on.
struct Component
{
  const double* first;
  std::size_t stride = 1;
  const double* minus = nullptr; ///< what is taken away from each, with the same stride; nothing if null

  double operator[](std::size_t row) const { return first[row * stride] - (minus ? minus[row * stride] : 0.0); }
};

/// A field of real numbers, one row per particle or node.
struct FieldView
{
  std::string name;
  std::size_t rows;
  std::vector<Component> components;
};

/// A field of whole numbers.
using IndexView = std::variant<std::span<const std::int64_t>, std::span<const std::int32_t>>;

/// A new array with a copy of a field, (n,) for numbers, (n, k) for vectors, tensors and states.
/// @param by_columns  components are stored one after another (Fortran's order) instead of rows
template <class T>
py::array_t<T> copied_field(const FieldView& field, bool by_columns = false)
{
  const std::size_t width = field.components.size(), n = field.rows;
  std::vector<std::size_t> shape{n};
  if (width > 1 || field.name == "state")
    shape.push_back(width);
  const std::size_t row_step = by_columns ? 1 : width, step = by_columns ? n : 1;
  std::vector<std::size_t> strides{row_step * sizeof(T), step * sizeof(T)};
  strides.resize(shape.size());
  py::array_t<T> array(shape, strides);
  T* out = array.mutable_data();
  for (std::size_t k = 0; k < width; ++k)
    for (std::size_t row = 0; row < n; ++row)
      out[row * row_step + k * step] = static_cast<T>(field.components[k][row]);
  return array;
}

/// Copies of the two components of a field as vectors of three, (n, 3), the third one zero.
template <class T>
py::array_t<T> padded_field(const FieldView& field)
{
  py::array_t<T> array(std::vector<std::size_t>{field.rows, 3});
  T* out = array.mutable_data();
  for (std::size_t row = 0; row < field.rows; ++row, out += 3)
  {
    out[0] = static_cast<T>(field.components[0][row]);
    out[1] = static_cast<T>(field.components[1][row]);
    out[2] = 0;
  }
  return array;
}

inline py::object copied_field(const IndexView& field)
{
  return std::visit(
      [](const auto& values) -> py::object
      {
        using T = typename std::remove_cvref_t<decltype(values)>::value_type;
        return py::array_t<T>(static_cast<py::ssize_t>(values.size()), values.data());
      },
      field);
}

/// A field of real numbers: a column, the displacement (position minus initial position) or the plastic strain (the
/// first state variable).
/// @throws InputError for a field that does not exist, or that no particle carries
template <int D>
FieldView real_field(const Particles<D>& particles, const std::string& name)
{
  FieldView view{name, particles.id.size(), {}};
  if (name == "displacement")
    for (int i = 0; i < D; ++i)
      view.components.push_back({particles.position[i].data(), 1, particles.initial_position[i].data()});
  else if (name == "plastic_strain" && !particles.state.empty())
    view.components.push_back({particles.state[0].data()});
  else
    for_each_field(particles,
                   [&](const Field& field, const auto& columns)
                   {
                     if constexpr (std::is_same_v<typename decltype(columns_of(columns))::value_type, const Column> ||
                                   std::is_same_v<typename decltype(columns_of(columns))::value_type, Column>)
                       if (field.name == name)
                       {
                         if (!is_present(columns))
                           throw InputError("particle field is '" + name + "', but no particle carries one");
                         for (const Column& column : columns_of(columns))
                           view.components.push_back({column.data()});
                       }
                   });
  if (view.components.empty())
    throw InputError("particle field is '" + name + "', which does not exist");
  return view;
}

/// Calls f(name, view) for the position and fields of particles, real ones and whole numbers.
/// @throws InputError as `real_field` does
template <int D, class F>
void for_each_view(const Particles<D>& particles, const std::vector<std::string>& names, F&& f)
{
  f("position", real_field(particles, "position"));
  for (const std::string& name : names)
  {
    bool is_whole = false;
    for_each_column(particles,
                    [&](std::string_view of, int, const auto& column)
                    {
                      if constexpr (!std::is_same_v<std::remove_cvref_t<decltype(column)>, Column>)
                        if (name == of)
                        {
                          is_whole = true;
                          f(name, IndexView(std::span(column)));
                        }
                    });
    if (!is_whole && name != "position")
      f(name, real_field(particles, name));
  }
}
} // namespace mpm::python
