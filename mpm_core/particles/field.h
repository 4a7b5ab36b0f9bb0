#pragma once
/// @file
/// What a field of particles or nodes is, as an entry of a schedule; and how its columns are stored.

#include "base/types.h"

#include <array>
#include <span>
#include <string_view>

namespace mpm::particles
{
/// An entry of the schedule of fields. Texts are kept by whoever declares the field.
struct Field
{
  std::string_view name;
  std::string_view unit;    ///< as in "kg/m3"; "-" without dimension
  std::string_view meaning; ///< a sentence
  bool settable = false;    ///< whether a user may overwrite it
  double initial = 0;       ///< of new particles, and of all where an optional field is absent
};

/// Columns of an optional field: without entries as long as all particles have the initial value.
template <std::size_t N>
struct OptionalColumns
{
  bool present = false; ///< a rank without particles must know it too
  std::array<Column, N> columns;

  Column& operator[](std::size_t k) { return columns[k]; }
  const Column& operator[](std::size_t k) const { return columns[k]; }
};

/// A field that a run declares for itself, such as a parameter that differs from particle to particle.
struct AddedField
{
  std::string name, unit, meaning;
  double initial = 0;
  std::vector<Column> columns;

  Field field() const { return {name, unit, meaning, true, initial}; }
};

/// The columns of a field, however they are stored: one, a fixed number, or a number known at run time.
template <class T, class A>
std::span<std::vector<T, A>> columns_of(std::vector<T, A>& column)
{
  return {&column, 1};
}
template <class T, class A>
std::span<const std::vector<T, A>> columns_of(const std::vector<T, A>& column)
{
  return {&column, 1};
}
template <std::size_t N>
std::span<Column> columns_of(std::array<Column, N>& columns)
{
  return columns;
}
template <std::size_t N>
std::span<const Column> columns_of(const std::array<Column, N>& columns)
{
  return columns;
}
inline std::span<Column> columns_of(std::vector<Column>& columns) { return columns; }
inline std::span<const Column> columns_of(const std::vector<Column>& columns) { return columns; }
template <std::size_t N>
std::span<Column> columns_of(OptionalColumns<N>& field)
{
  return field.columns;
}
template <std::size_t N>
std::span<const Column> columns_of(const OptionalColumns<N>& field)
{
  return field.columns;
}

template <class C>
inline constexpr bool is_optional = false;
template <std::size_t N>
inline constexpr bool is_optional<OptionalColumns<N>> = true;

/// Whether a field has its columns on all ranks; one that is not optional always has.
template <class C>
bool is_present(const C& columns)
{
  if constexpr (is_optional<C>)
    return columns.present;
  else
    return true;
}
} // namespace mpm::particles
