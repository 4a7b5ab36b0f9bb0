#include "model/rebalance.h"

#include "model/mapping.h"
#include "parallel/redistribution.h"

namespace mpm
{
template <int D>
void set_partition(Model<D>& model, const Mesh<D>& mesh)
{
  prepare(model); // so that ranks agree on which columns there are
  std::vector<GlobalIndex> cells;
  for (Index cell : model.particles.cell)
    cells.push_back(model.mesh.global_cells[cell]);
  model.mesh = mesh;
  model.exchange = make_node_exchange(mesh, model.exchange.comm);
  model.supports.clear();
  redistribute<D>(mesh, model.exchange, cells, model.particles);
  model.work = {};
  prepare(model);
  map_to_nodes(model);
}

template void set_partition(Model<2>&, const Mesh<2>&);
template void set_partition(Model<3>&, const Mesh<3>&);
} // namespace mpm
