#include "materials/laws/heterogeneous.h"

#include "materials/laws/strength_reduction.h"

#include <algorithm>
#include <cmath>

namespace mpm::materials
{
namespace
{
/// The declarations of the parameters that vary, in their order
template <class L>
std::vector<Parameter<L>> varying_parameters(const std::vector<std::string>& names)
{
  std::vector<Parameter<L>> found;
  for (const std::string& name : names)
    for (const Parameter<L>& parameter : L::parameters())
      if (parameter.name == name)
        found.push_back(parameter);
  return found;
}

template <class L>
void check_names(const L& law, const std::vector<std::string>& names)
{
  std::string known;
  for (const Parameter<L>& parameter : L::parameters())
    known += (known.empty() ? "" : ", ") + std::string(parameter.name);
  if (names.empty())
    throw InputError("varying is empty, expected names of parameters that vary, of " + known);
  for (const std::string& name : names)
  {
    if (varying_parameters<L>({name}).empty())
      throw InputError("varying has '" + name + "', expected parameters of the law that are numbers: " + known);
    if (std::count(names.begin(), names.end(), name) > 1)
      throw InputError("varying has '" + name + "' twice");
    if (!std::isfinite(varying_parameters<L>({name}).front().value(law))) // points have differences from it
      throw InputError("varying has '" + name +
                       "', which is infinite in the law, expected a law in which it is finite");
  }
}

/// Points have the state variables of the law itself, with which they begin.
template <class L>
void check_states(const L&, const std::vector<std::string>&)
{
}
void check_states(const HardeningSoil& law, const std::vector<std::string>& names)
{
  if (law.small_strain_modulus == 0 && std::count(names.begin(), names.end(), "small_strain_modulus"))
    throw InputError(
        "varying has 'small_strain_modulus', which is 0 in the law, expected a law in which it is above the "
        "shear modulus of unloading: points with small-strain stiffness have more state variables");
}

/// Whether two points have the same values
template <int D>
bool are_alike(const PointBatch<D>& points, int first_column, int columns, Index one, Index other)
{
  for (int k = first_column; k < first_column + columns; ++k)
    if (points.state[k][one] != points.state[k][other])
      return false;
  return true;
}

/// Past the last point that follows one with the same values
template <int D>
Index end_of_equals(const PointBatch<D>& points, int first_column, int columns, Index first)
{
  Index last = first + 1;
  while (last < points.size && are_alike(points, first_column, columns, first, last))
    ++last;
  return last;
}

template <int D, class L>
BatchReport update_pieces(const Heterogeneous& whole, const L& law, const PointBatch<D>& points)
{
  const std::vector<Parameter<L>> parameters = varying_parameters<L>(whole.varying);
  const int own = n_state(law), columns = static_cast<int>(parameters.size());
  BatchReport total;
  for (Index first = 0; first < points.size;)
  {
    const Index last = end_of_equals(points, own, columns, first);
    L here = law;
    for (int k = 0; k < columns; ++k)
    {
      const Parameter<L>& parameter = parameters[static_cast<std::size_t>(k)];
      parameter.set(here, parameter.value(law) + points.state[own + k][first]);
    }
    if (whole.strength_factor != 1)
      here = reduced_strength(here, whole.strength_factor);
    const BatchSlice<D> piece(points, first, last - first, own);
    const BatchReport report = update<D>(here, piece.batch);
    total.plastic += report.plastic;
    for (Index i : report.failed)
      total.failed.push_back(first + i);
    first = last;
  }
  return total;
}
} // namespace

std::vector<std::string> state_names(const Heterogeneous& law)
{
  std::vector<std::string> names = state_names(law.law);
  for (const std::string& name : law.varying)
    names.push_back(name + "_difference");
  return names;
}

void check(const Heterogeneous& law)
{
  check(law.law);
  std::visit(
      [&](const auto& l)
      {
        check_names(l, law.varying);
        check_states(l, law.varying);
      },
      law.law);
  if (n_state(law) > max_states)
    throw InputError("varying has " + std::to_string(law.varying.size()) + " names, too many for this law");
}

LawList<> law_of_point(const Heterogeneous& law, const std::vector<double>& differences)
{
  return std::visit(
      [&]<class L>(L point) -> LawList<>
      {
        const std::vector<Parameter<L>> parameters = varying_parameters<L>(law.varying);
        for (std::size_t k = 0; k < parameters.size(); ++k)
          parameters[k].set(point, parameters[k].value(point) + differences.at(k));
        return point;
      },
      law.law);
}

template <int D>
BatchReport update(const Heterogeneous& law, const PointBatch<D>& points)
{
  return std::visit([&](const auto& l) { return update_pieces<D>(law, l, points); }, law.law);
}

template BatchReport update<2>(const Heterogeneous&, const PointBatch<2>&);
template BatchReport update<3>(const Heterogeneous&, const PointBatch<3>&);
} // namespace mpm::materials
