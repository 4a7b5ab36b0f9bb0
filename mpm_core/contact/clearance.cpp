#include "contact/clearance.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mpm::contact
{
namespace
{
template <int D>
double apart(const Vector<D>& a, const Vector<D>& b)
{
  double sum = 0;
  for (int i = 0; i < D; ++i)
    sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum);
}
} // namespace

template <int D>
void keep_clearance(const Mesh<D>& mesh, Contact<D>& contact)
{
  if (!contact.clearance.empty() && contact.travel <= contact.cell_size)
    return;
  const RigidBody<D>& body = contact.body;
  contact.clearance.resize(static_cast<std::size_t>(mesh.owned_cells));
  contact.cell_reach.resize(static_cast<std::size_t>(mesh.owned_cells));
  contact.travel = 0;
  contact.cell_size = std::numeric_limits<double>::infinity();
  double farthest = 0;
  for (Index c = 0; c < mesh.owned_cells; ++c)
  {
    const Vector<D>& centre = mesh.shapes[c].centre;
    double reach = 0;
    for (Index node : mesh.cells[c])
      reach = std::max(reach, apart<D>(mesh.points[node], centre));
    // A particle is no farther from the centre of its cell than the vertices are; as much again is for its radius and
    // for its motion in a step.
    const Vector<D> x = as_at_start<D>(body, centre);
    contact.clearance[static_cast<std::size_t>(c)] = distance<D>(contact.surface, x).value - 3 * reach;
    contact.cell_reach[static_cast<std::size_t>(c)] = reach;
    contact.cell_size = std::min(contact.cell_size, reach);
    farthest = std::max(farthest, apart<D>(x, body.centre) + reach);
  }
  contact.reach = std::min(rotation_reach<D>(contact.surface, body.centre), farthest);
}

template void keep_clearance<2>(const Mesh<2>&, Contact<2>&);
template void keep_clearance<3>(const Mesh<3>&, Contact<3>&);
} // namespace mpm::contact
