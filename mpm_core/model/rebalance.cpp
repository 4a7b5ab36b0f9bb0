#include "model/rebalance.h"

#include "model/integration.h"
#include "model/mapping.h"
#include "model/moving_cells.h"
#include "parallel/redistribution.h"

namespace mpm::model
{
template <class G, int D>
void set_partition(Model<G>& model, const Mesh<D>& mesh, std::span<const GlobalIndex> owners)
{
  reset_cells(model);
  prepare(model);                              // so that ranks agree on which columns there are
  const double kinetic = model.energy.kinetic; // of nodes as supports hold them, which the new ones do not have yet
  std::vector<GlobalIndex> cells, ranks;
  for (Index cell : model.particles.cell)
  {
    cells.push_back(model.mesh.global_cells[cell]);
    ranks.push_back(owners[static_cast<std::size_t>(cell)]);
  }
  model.mesh = mesh;
  model.exchange = make_node_exchange(mesh, model.exchange.comm);
  redistribute<D>(mesh, model.exchange, cells, ranks, model.particles);
  for (VelocityField<G>& field : model.fields)
    field = {};
  group_soils(model);
  for (Contact<D>& contact : model.contacts)
    contact.bounds.clear(); // of cells that have other numbers now
  for (FieldContact<D>& contact : model.field_contacts)
  {
    contact.touching.clear();
    contact.scratch = {};
  }
  model.order = {};
  model.migration = {};
  model.ready = false;
  prepare(model);
  model.energy.kinetic = kinetic;
  map_to_nodes(model);
}

template void set_partition(Model<PlaneStrain>&, const Mesh<2>&, std::span<const GlobalIndex>);
template void set_partition(Model<Axisymmetric>&, const Mesh<2>&, std::span<const GlobalIndex>);
template void set_partition(Model<Solid>&, const Mesh<3>&, std::span<const GlobalIndex>);
} // namespace mpm::model
