#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <mpi.h>

#include <cstdint>

namespace mpm::python
{
void bind_laws(pybind11::module_& m);
/// Laws of soil and rock that are not made of others
void bind_soil_laws(pybind11::module_& m);
/// Laws written in Python
void bind_python_law(pybind11::module_& m);
/// Meshes, and what ranks find of each other's
void bind_meshes(pybind11::module_& m);
/// What models are made with: geometries, pore water, options of explicit runs
void bind_options(pybind11::module_& m);
void bind_models(pybind11::module_& m);
void bind_contacts(pybind11::module_& m);
void bind_members(pybind11::module_& m);
void bind_implicit(pybind11::module_& m);
void bind_checkpoints(pybind11::module_& m);

/// The communicator at an address that mpi4py gives (`MPI._addressof(comm)`).
inline MPI_Comm communicator(std::uintptr_t address) { return *reinterpret_cast<MPI_Comm*>(address); }
} // namespace mpm::python
