#include "parallel/partition.h"

#include "parallel/agreement.h"
#include "parallel/halo.h"

#ifdef TALUS_SCOTCH
#include <cstdio> // which scotch.h needs before it

#include <ptscotch.h>
#endif

namespace mpm::parallel
{
template <int D>
std::vector<double> with_ghost_values(const Mesh<D>& mesh, std::span<const double> owned, MPI_Comm comm)
{
  std::vector<double> values(owned.begin(), owned.end());
  values.resize(mesh.cells.size());
  update(make_halos(mesh, comm).cells, values);
  return values;
}

#ifdef TALUS_SCOTCH
namespace
{
/// The graph of cells that share a facet, as PT-SCOTCH takes it: vertices are numbered through by rising rank.
struct CellGraph
{
  std::vector<SCOTCH_Num> offsets{0}, neighbours, weights;
};

template <int D>
CellGraph cell_graph(const Mesh<D>& mesh, std::span<const GlobalIndex> weights, MPI_Comm comm)
{
  const GlobalIndex first = row_slice(comm, static_cast<std::size_t>(mesh.owned_cells)).before;
  std::vector<double> own;
  own.reserve(weights.size());
  for (Index c = 0; c < mesh.owned_cells; ++c)
    own.push_back(static_cast<double>(first + c));
  const std::vector<double> numbers = with_ghost_values(mesh, own, comm);
  CellGraph graph;
  // A rank without cells must give arrays too: PT-SCOTCH takes none on one rank for another kind of graph.
  graph.neighbours.reserve(1);
  graph.weights.reserve(1);
  for (Index c = 0; c < mesh.owned_cells; ++c)
  {
    for (Index neighbour : mesh.neighbours[c])
      if (neighbour != none)
        graph.neighbours.push_back(static_cast<SCOTCH_Num>(numbers[neighbour]));
    graph.offsets.push_back(static_cast<SCOTCH_Num>(graph.neighbours.size()));
  }
  for (GlobalIndex weight : weights)
    graph.weights.push_back(static_cast<SCOTCH_Num>(weight));
  return graph;
}

/// @returns whether PT-SCOTCH found parts
bool find_parts(CellGraph& graph, MPI_Comm comm, std::vector<SCOTCH_Num>& parts)
{
  int size = 1;
  MPI_Comm_size(comm, &size);
  // The same parts each time: what its threads find depends on which is first.
  SCOTCH_Context context;
  SCOTCH_contextInit(&context);
  SCOTCH_contextOptionSetNum(&context, SCOTCH_OPTIONNUMDETERMINISTIC, 1);
  SCOTCH_contextRandomReset(&context);
  SCOTCH_Dgraph dgraph, bound;
  SCOTCH_Strat strategy; // PT-SCOTCH's own
  SCOTCH_stratInit(&strategy);
  bool good = SCOTCH_dgraphInit(&dgraph, comm) == 0 && SCOTCH_dgraphInit(&bound, comm) == 0;
  const auto vertices = static_cast<SCOTCH_Num>(graph.weights.size());
  const auto edges = static_cast<SCOTCH_Num>(graph.neighbours.size());
  good = good && SCOTCH_dgraphBuild(&dgraph, 0, vertices, vertices, graph.offsets.data(), nullptr, graph.weights.data(),
                                    nullptr, edges, edges, graph.neighbours.data(), nullptr, nullptr) == 0;
  good = good && SCOTCH_contextBindDgraph(&context, &dgraph, &bound) == 0;
  good = good && SCOTCH_dgraphPart(&bound, size, &strategy, parts.data()) == 0;
  SCOTCH_dgraphExit(&bound);
  SCOTCH_dgraphExit(&dgraph);
  SCOTCH_contextExit(&context);
  SCOTCH_stratExit(&strategy);
  return good;
}
} // namespace

template <int D>
std::vector<Index> weighted_parts(const Mesh<D>& mesh, std::span<const GlobalIndex> weights, MPI_Comm comm)
{
  CellGraph graph = cell_graph(mesh, weights, comm);
  std::vector<SCOTCH_Num> parts(weights.size() + 1);
  const bool good = find_parts(graph, comm, parts);
  if (const std::string text = shared_failure(comm, good ? "" : "PT-SCOTCH could not partition the mesh");
      !text.empty())
    throw RunError(text);
  return {parts.begin(), parts.end() - 1};
}
#else
template <int D>
std::vector<Index> weighted_parts(const Mesh<D>&, std::span<const GlobalIndex>, MPI_Comm)
{
  throw RunError(
      "the mesh cannot be repartitioned: this program was built without PT-SCOTCH (Debian: libptscotch-dev). Without "
      "`rebalance`, or with a large one, a run keeps its first partition");
}
#endif

#define INSTANTIATE(D)                                                                                                 \
  template std::vector<double> with_ghost_values(const Mesh<D>&, std::span<const double>, MPI_Comm);                   \
  template std::vector<Index> weighted_parts(const Mesh<D>&, std::span<const GlobalIndex>, MPI_Comm);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm::parallel
