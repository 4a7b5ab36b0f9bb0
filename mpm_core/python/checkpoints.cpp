#include "python/bindings.h"

#include "io/checkpoint.h"
#include "model/state.h"
#include "python/arrays.h"

namespace mpm::python
{
namespace
{
namespace py = pybind11;

template <class G, int D = G::dim>
void save(Model<G>& model, const std::string& path, const std::string& description, bool with_partition)
{
  prepare(model);
  StateTables state{rank_state(model), cell_state(model)};
  if (with_partition)
    state.cells.push_back(owned_cells_table(model.mesh));
  write_checkpoint<D>(model.exchange.comm, path, model.mesh, model.particles, state, description);
}

template <class G, int D = G::dim>
void restore(Model<G>& model, const std::string& path)
{
  const StateTables expected{rank_state(model), empty_cell_state(model)};
  Checkpoint<D> checkpoint =
      read_checkpoint<D>(model.exchange, path, model.mesh, model.particles, model.laws.size(), expected);
  if (checkpoint.same_parts)
    restore_same(model, std::move(checkpoint.particles), checkpoint.state.ranks, checkpoint.state.cells);
  else
    restore_other(model, std::move(checkpoint.particles), checkpoint.state.ranks);
}

template <class G, int D = G::dim>
void bind(py::module_& m)
{
  m.def("save", &save<G>);
  m.def("restore", &restore<G>);
  m.def("mesh_fingerprint", [](const Model<G>& model) { return mesh_fingerprint<D>(model.exchange.comm, model.mesh); });
}
} // namespace

void bind_checkpoints(py::module_& m)
{
  m.def("checkpoint_description", [](std::uintptr_t comm, const std::string& path)
        { return py::bytes(checkpoint_description(communicator(comm), path)); }); // bytes: it may be no text
  m.def("checkpoint_cells", [](std::uintptr_t comm, const std::string& path)
        { return copied(checkpoint_cells(communicator(comm), path)); });
  bind<PlaneStrain>(m);
  bind<Axisymmetric>(m);
  bind<Solid>(m);
}
} // namespace mpm::python
