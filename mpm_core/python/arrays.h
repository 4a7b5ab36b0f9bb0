#pragma once
/// @file
/// NumPy arrays in and out, with errors that name the argument.

#include "base/types.h"

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <span>

namespace mpm::python
{
namespace py = pybind11;

inline std::string shape_text(const py::array& array)
{
  std::string text = "(";
  for (py::ssize_t i = 0; i < array.ndim(); ++i)
    text += (i ? ", " : "") + std::to_string(array.shape(i));
  return text + (array.ndim() == 1 ? ",)" : ")");
}

/// Checks that an array holds values of type T, row-major, in the given shape; -1 stands for any length.
template <class T>
void check_array(const char* name, const py::array& array, std::initializer_list<py::ssize_t> shape)
{
  if (!py::isinstance<py::array_t<T>>(array))
    throw InputError(std::string(name) + " has dtype " + std::string(py::str(array.dtype())) + ", expected " +
                     std::string(py::str(py::dtype::of<T>())));
  bool same = array.ndim() == static_cast<py::ssize_t>(shape.size());
  std::string expected = "(";
  py::ssize_t i = 0;
  for (py::ssize_t length : shape)
  {
    same = same && (length < 0 || array.shape(i) == length);
    expected += (i++ ? ", " : "") + (length < 0 ? std::string("n") : std::to_string(length));
  }
  if (!same)
    throw InputError(std::string(name) + " has shape " + shape_text(array) + ", expected " + expected +
                     (shape.size() == 1 ? ",)" : ")"));
  if (!(array.flags() & py::array::c_style))
    throw InputError(std::string(name) + " is not stored row by row (C order); pass numpy.ascontiguousarray of it");
}

/// The values of an array, in place.
template <class T>
std::span<const T> values(const py::array& array)
{
  return {static_cast<const T*>(array.data()), static_cast<std::size_t>(array.size())};
}

template <class T>
std::span<T> mutable_values(const char* name, py::array& array)
{
  if (!array.writeable())
    throw InputError(std::string(name) + " is read-only, expected an array that can be written");
  return {static_cast<T*>(array.mutable_data()), static_cast<std::size_t>(array.size())};
}

/// A new array with a copy of the values, shape (n,).
template <class T, class Allocator>
py::array_t<T> copied(const std::vector<T, Allocator>& values)
{
  return py::array_t<T>(static_cast<py::ssize_t>(values.size()), values.data());
}
} // namespace mpm::python
