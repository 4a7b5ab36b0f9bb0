#include "python/bindings.h"

#include "mesh/search.h"
#include "parallel/messages.h"
#include "parallel/partition.h"
#include "particles/seed.h"
#include "python/arrays.h"

namespace mpm::python
{
namespace
{
template <int D>
std::shared_ptr<Mesh<D>> mesh_from_arrays(const py::array& points, const py::array& cells, const py::array& cell_tags,
                                          const py::array& facets, const py::array& facet_tags,
                                          const py::array& global_nodes, const py::array& global_cells,
                                          const py::array& cell_owners, int rank)
{
  check_array<double>("points", points, {-1, D});
  check_array<Index>("cells", cells, {-1, D + 1});
  check_array<Index>("cell_tags", cell_tags, {-1});
  check_array<Index>("facets", facets, {-1, D});
  check_array<Index>("facet_tags", facet_tags, {facets.shape(0)});
  check_array<GlobalIndex>("global_nodes", global_nodes, {-1});
  check_array<GlobalIndex>("global_cells", global_cells, {-1});
  check_array<Index>("cell_owners", cell_owners, {-1});
  return std::make_shared<Mesh<D>>(
      make_mesh<D>({values<double>(points), values<Index>(cells), values<Index>(cell_tags), values<Index>(facets),
                    values<Index>(facet_tags), values<GlobalIndex>(global_nodes), values<GlobalIndex>(global_cells),
                    values<Index>(cell_owners)},
                   rank));
}

template <int D>
py::array_t<Index> cells_of(const Mesh<D>& mesh, const py::array& points)
{
  check_array<double>("points", points, {-1, D});
  const auto x = values<double>(points);
  py::array_t<Index> cells(points.shape(0));
  for (py::ssize_t p = 0; p < points.shape(0); ++p)
  {
    Vector<D> at;
    std::copy_n(&x[static_cast<std::size_t>(p) * D], D, at.begin());
    cells.mutable_data()[p] = find_cell_in_bins<D>(mesh, at);
  }
  return cells;
}

/// A row for each cell, a number for each of its vertices.
template <std::size_t N>
py::array_t<Index> cell_rows(const std::vector<std::array<Index, N>>& rows)
{
  py::array_t<Index> array({rows.size(), N});
  for (std::size_t c = 0; c < rows.size(); ++c)
    std::copy(rows[c].begin(), rows[c].end(), array.mutable_data() + c * N);
  return array;
}

/// Rank and row of the first holder of each wanted item, shape (n, 2); -1 where no rank has it.
/// @note Collective
py::array_t<GlobalIndex> first_holders(const py::array& numbers, const py::array& rows, const py::array& wanted,
                                       std::uintptr_t comm)
{
  check_array<GlobalIndex>("numbers", numbers, {-1});
  check_array<GlobalIndex>("rows", rows, {numbers.shape(0)});
  check_array<GlobalIndex>("wanted", wanted, {-1});
  const auto holders = find_holders(values<GlobalIndex>(numbers), values<GlobalIndex>(rows),
                                    values<GlobalIndex>(wanted), communicator(comm));
  py::array_t<GlobalIndex> result({static_cast<py::ssize_t>(holders.size()), py::ssize_t{2}});
  auto first = result.mutable_unchecked<2>();
  for (py::ssize_t k = 0; k < result.shape(0); ++k)
  {
    const auto& found = holders[static_cast<std::size_t>(k)];
    first(k, 0) = found.empty() ? -1 : found.front().rank;
    first(k, 1) = found.empty() ? -1 : found.front().row;
  }
  return result;
}

template <int D>
void bind_mesh(py::module_& m, const std::string& suffix)
{
  py::class_<Mesh<D>, std::shared_ptr<Mesh<D>>>(m, ("Mesh" + suffix).c_str())
      .def(py::init(&mesh_from_arrays<D>))
      .def_property_readonly("owned_cells", [](const Mesh<D>& mesh) { return mesh.owned_cells; })
      .def_static("even_points", &even_points<D>)
      .def_property_readonly("cell_tags", [](const Mesh<D>& mesh) { return copied(mesh.cell_tags); })
      .def("cells_of", &cells_of<D>)
      .def_property_readonly("neighbours", [](const Mesh<D>& mesh) { return cell_rows(mesh.neighbours); })
      .def_property_readonly("facet_tags", [](const Mesh<D>& mesh) { return cell_rows(mesh.facet_tags); })
      .def("with_ghost_values",
           [](const Mesh<D>& mesh, const py::array& owned, std::uintptr_t comm)
           {
             check_array<double>("owned", owned, {static_cast<py::ssize_t>(mesh.owned_cells)});
             return copied(with_ghost_values<D>(mesh, values<double>(owned), communicator(comm)));
           })
      .def("weighted_parts",
           [](const Mesh<D>& mesh, const py::array& weights, std::uintptr_t comm)
           {
             check_array<GlobalIndex>("weights", weights, {static_cast<py::ssize_t>(mesh.owned_cells)});
             return copied(weighted_parts<D>(mesh, values<GlobalIndex>(weights), communicator(comm)));
           })
      .def("volumes",
           [](const Mesh<D>& mesh)
           {
             std::vector<double> volumes;
             for (const auto& shape : mesh.shapes)
               volumes.push_back(shape.volume);
             return copied(volumes);
           });
}

/// Motion of the ground beside sides over time: heights (n), times (m), velocities and tractions (m, n, D).
} // namespace

void bind_meshes(py::module_& m)
{
  bind_mesh<2>(m, "2");
  bind_mesh<3>(m, "3");
  m.def("first_holders", &first_holders);
}
} // namespace mpm::python
