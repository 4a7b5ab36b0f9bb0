#include "model/field_contact_state.h"

#include <algorithm>

namespace mpm::model
{
namespace
{
template <int D>
constexpr int numbers_of_node = 2 * D + 2;
} // namespace

template <int D>
Table empty_touching_table(std::size_t contact)
{
  return {"field_contact_" + std::to_string(contact), (D + 1) * numbers_of_node<D> + 1, {}};
}

template <class G, int D>
Table touching_table(const Model<G, D>& model, std::size_t contact)
{
  Table table = empty_touching_table<D>(contact);
  const std::vector<ContactNode<D>>& touching = model.field_contacts[contact].touching;
  for (Index c = 0; c < model.mesh.owned_cells && !touching.empty(); ++c)
  {
    std::vector<double> row{static_cast<double>(model.mesh.global_cells[static_cast<std::size_t>(c)])};
    bool touches = false;
    for (Index node : model.mesh.cells[c])
    {
      const auto found = std::ranges::lower_bound(touching, node, {}, &ContactNode<D>::node);
      const bool is_there = found != touching.end() && found->node == node;
      const ContactNode<D> at = is_there ? *found : ContactNode<D>{};
      row.insert(row.end(), {at.gap, at.sticks ? 1.0 : 0.0});
      row.insert(row.end(), at.force.begin(), at.force.end());
      row.insert(row.end(), at.shift.begin(), at.shift.end());
      touches |= is_there;
    }
    if (touches)
      table.values.insert(table.values.end(), row.begin(), row.end());
  }
  return table;
}

template <class G, int D>
void take_touching(Model<G, D>& model, const Table& table, std::size_t contact)
{
  FieldContact<D>& of_fields = model.field_contacts[contact];
  std::vector<ContactNode<D>>& touching = of_fields.touching;
  touching.clear();
  of_fields.dt = model.last.dt;
  const auto width = static_cast<std::size_t>(table.width);
  for (std::size_t row = 0; row < table.values.size(); row += width)
  {
    const Index cell = model.migration.owned_cells.at(static_cast<GlobalIndex>(table.values[row]));
    const double* value = &table.values[row + 1];
    for (Index node : model.mesh.cells[cell])
    {
      ContactNode<D> at{
          node, distance<D>(of_fields.interface, model.mesh.points[node]).normal, value[0], {}, value[1] != 0, {}};
      std::copy_n(value + 2, D, at.force.begin());
      std::copy_n(value + 2 + D, D, at.shift.begin());
      value += numbers_of_node<D>;
      if (at.force != Vector<D>{})
        touching.push_back(at);
    }
  }
  std::ranges::sort(touching, {}, &ContactNode<D>::node);
  const auto repeated = std::ranges::unique(touching, {}, &ContactNode<D>::node);
  touching.erase(repeated.begin(), repeated.end());
}

#define INSTANTIATE(G)                                                                                                 \
  template Table touching_table(const Model<G>&, std::size_t);                                                         \
  template void take_touching(Model<G>&, const Table&, std::size_t);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
template Table empty_touching_table<2>(std::size_t);
template Table empty_touching_table<3>(std::size_t);
} // namespace mpm::model
