#include "mesh/part.h"

#include <algorithm>

namespace mpm::mesh
{
namespace
{
/// The numbers whose mark is set, rising.
std::vector<Index> marked(const std::vector<unsigned char>& marks)
{
  std::vector<Index> numbers;
  for (std::size_t i = 0; i < marks.size(); ++i)
    if (marks[i])
      numbers.push_back(static_cast<Index>(i));
  return numbers;
}

/// Brings the entries from `old_size` on among the rising ones before them.
void merge_tail(std::vector<Index>& numbers, std::size_t old_size)
{
  const auto middle = numbers.begin() + static_cast<std::ptrdiff_t>(old_size);
  std::sort(middle, numbers.end());
  std::inplace_merge(numbers.begin(), middle, numbers.end());
}
} // namespace

template <int D>
MeshPart make_part(const Mesh<D>& mesh, std::span<const Index> cells, std::span<const Index> more_nodes)
{
  MeshPart part;
  part.has_cell.resize(mesh.cells.size());
  part.has_node.resize(mesh.points.size());
  for (Index c : cells)
  {
    part.has_cell[c] = 1;
    for (Index node : mesh.cells[c])
      part.has_node[node] = 1;
  }
  for (Index node : more_nodes)
    part.has_node[node] = 1;
  part.cells = marked(part.has_cell);
  part.nodes = marked(part.has_node);
  return part;
}

template <int D>
void add_cells(const Mesh<D>& mesh, std::span<const Index> cells, MeshPart& part)
{
  const std::size_t n_cells = part.cells.size(), n_nodes = part.nodes.size();
  for (Index c : cells)
  {
    if (part.has_cell[c])
      continue;
    part.has_cell[c] = 1;
    part.cells.push_back(c);
    for (Index node : mesh.cells[c])
      if (!part.has_node[node])
      {
        part.has_node[node] = 1;
        part.nodes.push_back(node);
      }
  }
  if (part.cells.size() == n_cells)
    return;
  merge_tail(part.cells, n_cells);
  merge_tail(part.nodes, n_nodes);
}

#define INSTANTIATE(D)                                                                                                 \
  template MeshPart make_part<D>(const Mesh<D>&, std::span<const Index>, std::span<const Index>);                      \
  template void add_cells<D>(const Mesh<D>&, std::span<const Index>, MeshPart&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm::mesh
