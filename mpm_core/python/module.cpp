#include "python/bindings.h"

#include "base/types.h"

PYBIND11_MODULE(_core, m)
{
  m.doc() = "Compiled part of mpm_core: arrays in, arrays out. Use it through the package mpm_core.";
  m.attr("version") = TALUS_VERSION;
  m.attr("compiler") = __VERSION__;
  pybind11::register_exception<mpm::base::InputError>(m, "InputError", PyExc_ValueError);
  pybind11::register_exception<mpm::base::RunError>(m, "RunError", PyExc_RuntimeError);
  mpm::python::bind_laws(m);
  mpm::python::bind_meshes(m);
  mpm::python::bind_options(m);
  mpm::python::bind_models(m);
  mpm::python::bind_contacts(m);
  mpm::python::bind_members(m);
  mpm::python::bind_implicit(m);
  mpm::python::bind_checkpoints(m);
}
