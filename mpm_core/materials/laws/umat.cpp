#include "materials/laws/umat.h"

#include "materials/tools/elasticity.h"
#include "materials/tools/require.h"
#include "materials/tools/rotation.h"

#include <algorithm>
#include <cmath>
#include <dlfcn.h>

namespace mpm::materials
{
namespace
{
/// Place of each component in Abaqus's order
constexpr std::array<std::size_t, 6> abaqus_place{0, 1, 2, 3, 5, 4};

/// What a call reads and writes
template <int D>
struct Arguments
{
  static constexpr std::size_t n = n_stress<D>;
  std::array<double, n> stress, strain, increment;
  std::array<double, 9> gradient_before, gradient, rotation; ///< row by row
  double time, duration, length;
  std::array<double, n * n> ddsdde{};
  std::array<double, max_states> variables{};
  double new_step = 1; ///< PNEWDT
};

/// Increment of the deformation gradient of a point, row by row
template <int D>
std::array<double, 9> deformation_increment(const PointBatch<D>& points, Index i)
{
  std::array<double, 9> f{1, 0, 0, 0, 1, 0, 0, 0, 1};
  if (points.deformation.front())
  {
    for (std::size_t a = 0; a < D; ++a)
      for (std::size_t b = 0; b < D; ++b)
        f[3 * a + b] = points.deformation[a * D + b][i];
    return f;
  }
  const auto& strain = points.strain_increment;
  for (std::size_t k = 0; k < 3; ++k)
    f[4 * k] += strain[k][i];
  constexpr std::array<std::array<std::size_t, 2>, 3> shears{{{1, 3}, {5, 7}, {2, 6}}}; // xy, yz, xz
  for (std::size_t k = 3; k < n_stress<D>; ++k)
    for (std::size_t entry : shears[k - 3])
      f[entry] = 0.5 * strain[k][i];
  return f;
}

std::array<double, 9> product(const std::array<double, 9>& a, const std::array<double, 9>& b)
{
  std::array<double, 9> c{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k)
        c[3 * i + j] += a[3 * i + k] * b[3 * k + j];
  return c;
}

std::array<double, 9> transposed(const std::array<double, 9>& a)
{
  return {a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8]};
}

/// Rotation of the material in an increment, by which stresses have been turned already
std::array<double, 9> rotation_of(const std::array<double, 9>& f)
{
  const Matrix<3> rotation = materials::rotation_of<3>({{{f[0], f[1], f[2]}, {f[3], f[4], f[5]}, {f[6], f[7], f[8]}}});
  std::array<double, 9> rows;
  for (std::size_t k = 0; k < 9; ++k)
    rows[k] = rotation[k / 3][k % 3];
  return rows;
}

/// Turns the strain of STRAN with the material.
template <int D>
void turn_strain(const std::array<double, 9>& rotation, std::array<double, n_stress<D>>& strain)
{
  std::array<double, 9> tensor{};
  const auto entries = [](std::size_t k) // of a component, in Abaqus's order
  {
    constexpr std::array<std::array<std::size_t, 2>, 6> pairs{{{0, 0}, {4, 4}, {8, 8}, {1, 3}, {2, 6}, {5, 7}}};
    return pairs[k];
  };
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    for (std::size_t entry : entries(k))
      tensor[entry] = strain[k] * (k < 3 ? 1 : 0.5);
  tensor = product(product(rotation, tensor), transposed(rotation));
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    strain[k] = tensor[entries(k)[0]] * (k < 3 ? 1 : 2);
}

/// First of the columns of the deformation gradient, and of STATEV
constexpr int first_gradient = 7, first_variable = 16;

template <int D>
Arguments<D> loaded(const Umat& law, const PointBatch<D>& points, Index i)
{
  Arguments<D> a;
  for (std::size_t k = 0; k < n_stress<D>; ++k)
  {
    a.stress[abaqus_place[k]] = points.stress[k][i];
    a.increment[abaqus_place[k]] = points.strain_increment[k][i];
    a.strain[abaqus_place[k]] = points.state[1 + k][i];
  }
  for (int k = 0; k < law.n_variables; ++k)
    a.variables[static_cast<std::size_t>(k)] = points.state[first_variable + k][i];
  for (std::size_t k = 0; k < 9; ++k)
    a.gradient_before[k] = points.state[first_gradient + static_cast<int>(k)][i] + (k % 4 == 0 ? 1 : 0);
  const std::array<double, 9> f = deformation_increment(points, i);
  a.gradient = product(f, a.gradient_before);
  a.rotation = rotation_of(f);
  turn_strain<D>(a.rotation, a.strain);
  a.time = points.time;
  a.duration = std::isfinite(points.dt) ? points.dt : 1;
  a.length = points.cell_size ? points.cell_size[i] : 1;
  return a;
}

template <int D>
void call(const Umat& law, Index i, Arguments<D>& a)
{
  constexpr int normals = 3, shears = n_stress<D> - 3, tensor = n_stress<D>, one = 1, none = 0;
  const int variables = law.n_variables, properties = static_cast<int>(law.properties.size()), point = i + 1;
  const std::array<int, 4> step{1, 0, 0, 0}; // JSTEP
  double sse = 0, spd = 0, scd = 0, rpl = 0, drpldt = 0;
  std::array<double, 6> ddsddt{}, drplde{};
  const std::array<double, 2> time{a.time, a.time};
  const std::array<double, 3> coords{};
  const std::array<double, 9> before = transposed(a.gradient_before), after = transposed(a.gradient); // Fortran
  const std::array<double, 9> rotation = transposed(a.rotation);
  const double zero = 0;
  std::array<char, 80> name;
  name.fill(' ');
  law.function(a.stress.data(), a.variables.data(), a.ddsdde.data(), &sse, &spd, &scd, &rpl, ddsddt.data(),
               drplde.data(), &drpldt, a.strain.data(), a.increment.data(), time.data(), &a.duration, &zero, &zero,
               &zero, &zero, name.data(), &normals, &shears, &tensor, &variables, law.properties.data(), &properties,
               coords.data(), rotation.data(), &a.new_step, &a.length, before.data(), after.data(), &one, &point, &none,
               &one, step.data(), &one, name.size());
}

/// Whether the call succeeded; the stress is looked at as a sum of squares
template <int D>
bool is_good(const Umat& law, const Arguments<D>& a)
{
  const bool variables = std::all_of(a.variables.begin(), a.variables.begin() + law.n_variables,
                                     [](double v) { return std::isfinite(v); });
  return a.new_step >= 1 && variables && is_usable<D>(a.stress);
}

template <int D>
void store(const Umat& law, const Arguments<D>& a, const PointBatch<D>& points, Index i)
{
  for (std::size_t k = 0; k < n_stress<D>; ++k)
  {
    points.stress[k][i] = a.stress[abaqus_place[k]];
    points.state[1 + k][i] = a.strain[abaqus_place[k]] + points.strain_increment[k][i];
  }
  for (int k = 0; k < law.n_variables; ++k)
    points.state[first_variable + k][i] = a.variables[static_cast<std::size_t>(k)];
  for (std::size_t k = 0; k < 9; ++k)
    points.state[first_gradient + static_cast<int>(k)][i] = a.gradient[k] - (k % 4 == 0 ? 1 : 0);
  if (law.plastic_strain_variable > 0)
    points.state[0][i] = a.variables[static_cast<std::size_t>(law.plastic_strain_variable - 1)];
}
} // namespace

UmatFunction load_umat(const std::string& library, const std::string& symbol)
{
  void* const handle = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle)
    throw InputError("library is '" + library + "', which cannot be loaded: " + dlerror());
  void* const address = dlsym(handle, symbol.c_str());
  if (!address)
    throw InputError("symbol is '" + symbol + "', which '" + library + "' does not have: " + dlerror());
  return reinterpret_cast<UmatFunction>(address);
}

std::string library_file(UmatFunction function)
{
  Dl_info info{};
  if (dladdr(reinterpret_cast<void*>(function), &info) == 0 || !info.dli_fname)
    return {};
  return info.dli_fname;
}

std::vector<std::string> state_names(const Umat& law)
{
  std::vector<std::string> names{"plastic_strain", "strain_xx", "strain_yy", "strain_zz",
                                 "strain_xy",      "strain_yz", "strain_xz"};
  for (const char a : {'x', 'y', 'z'})
    for (const char b : {'x', 'y', 'z'})
      names.push_back(std::string("displacement_gradient_") + a + b);
  for (int k = 1; k <= law.n_variables; ++k)
    names.push_back("statev_" + std::to_string(k));
  return names;
}

std::pair<std::vector<StrengthKind>, std::vector<double>> named_strength(const Umat& law)
{
  std::pair<std::vector<StrengthKind>, std::vector<double>> found;
  for (const auto& [number, kind] : law.strength)
  {
    found.first.push_back(kind);
    found.second.push_back(law.properties[static_cast<std::size_t>(number - 1)]);
  }
  return found;
}

void check(const Umat& law)
{
  require(law.n_variables >= 0 && law.n_variables <= max_states - 18, "n_variables", law.n_variables, "from 0 to 55");
  require(law.plastic_strain_variable >= 0 && law.plastic_strain_variable <= law.n_variables, "plastic_strain_variable",
          law.plastic_strain_variable, "0, or the number of a state variable");
  for (double property : law.properties)
    require(std::isfinite(property), "properties", property, "finite numbers");
  std::vector<StrengthKind> kinds;
  for (const auto& [number, kind] : law.strength)
  {
    require(number >= 1 && number <= static_cast<int>(law.properties.size()), "strength_parameters", number,
            "the number of one of the properties, from one");
    kinds.push_back(kind);
  }
  check(kinds);
  check_parameters(law);
}

template <int D>
BatchReport update(const Umat& law, const PointBatch<D>& points)
{
  constexpr std::size_t n = n_stress<D>;
  BatchReport report;
  for (Index i = 0; i < points.size; ++i)
  {
    Arguments<D> a = loaded(law, points, i);
    call(law, i, a);
    if (!is_good(law, a))
    {
      report.failed.push_back(i);
      a.ddsdde.fill(0);
    }
    else
    {
      const double before = points.state[0][i];
      store(law, a, points, i);
      report.plastic += points.state[0][i] > before ? 1 : 0;
    }
    for (std::size_t k = 0; points.tangent && k < n * n; ++k)
      points.tangent[static_cast<std::size_t>(i) * n * n + k] =
          a.ddsdde[abaqus_place[k / n] + abaqus_place[k % n] * n]; // column by column in Fortran
  }
  return report;
}

template BatchReport update<2>(const Umat&, const PointBatch<2>&);
template BatchReport update<3>(const Umat&, const PointBatch<3>&);
} // namespace mpm::materials
