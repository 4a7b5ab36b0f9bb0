/// Updates of one law at points that stay elastic, or that all yield, in increments as explicit steps have them:
/// `mpm_counted_laws LAW elastic|plastic 2|3 [REPEATS]`, whose instructions `tests/bench/laws.py` counts under
/// callgrind. Prints the time per point as well.

#include "materials/laws/law.h"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string_view>

using namespace mpm::materials;
using mpm::base::Index;
using mpm::base::n_stress;

namespace
{
constexpr Index size = 960;       ///< points
constexpr int steps_before = 400; ///< in which points come to yield
constexpr int steps = 20;

const MohrCoulomb soil{1e7, 0.3, 100, 33, 0};

/// The law of this name, with a strength that soil reaches or never reaches
Law law_of(std::string_view name, bool yields)
{
  const double cohesion = yields ? 100 : 1e6, largest_pressure = yields ? 20e3 : 400e3;
  MohrCoulomb mohr_coulomb = soil;
  mohr_coulomb.cohesion = cohesion;
  if (name == "LinearElastic")
    return LinearElastic{soil.young, soil.poisson};
  if (name == "MohrCoulomb")
    return mohr_coulomb;
  if (name == "ViscoplasticMohrCoulomb")
    return ViscoplasticMohrCoulomb{mohr_coulomb, 1e3};
  if (name == "SofteningMohrCoulomb")
    return SofteningMohrCoulomb{mohr_coulomb, 0.5 * cohesion, 25, 0, 0.1, 0.25};
  if (name == "DruckerPrager")
    return DruckerPrager{soil.young, soil.poisson, cohesion, 0.4};
  if (name == "CamClay")
    return CamClay{0.2, 0.04, 1.2, 0.2, largest_pressure, 1.0, 1e3};
  if (name == "NorSand")
    return NorSand{1.0, 0.03, 1.25, 4, 100, 200, 0.2, largest_pressure, 0.9, 0.2, 1e3};
  if (name == "Sanisand")
    return Sanisand{125,
                    0.05,
                    1.25,
                    0.712,
                    0.934,
                    0.019,
                    0.7,
                    7.05,
                    0.968,
                    1.1,
                    0.704,
                    3.5,
                    4,
                    600,
                    0.8,
                    largest_pressure,
                    yields ? 0.01 : 1.0, // q/p is 0.75 at the start
                    1e3};
  if (name == "HardeningSoil" || name == "small-strain HardeningSoil")
  {
    HardeningSoil law{10e6, 10e6, 30e6, 100, 33};
    law.vertical_preconsolidation = yields ? 0 : largest_pressure;
    law.small_strain_modulus = name == "HardeningSoil" ? 0 : 50e6;
    return law;
  }
  if (name == "HoekBrown")
    return HoekBrown{soil.young, soil.poisson, yields ? 20e3 : 400e6, 20, 4};
  std::fprintf(stderr, "unknown law %s\n", name.data());
  std::exit(1);
}

/// Points at depths of up to 2 m, which are sheared in one direction each, or to and fro
template <int D>
struct Ground
{
  explicit Ground(const Law& law) : states(static_cast<std::size_t>(n_state(law)))
  {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    for (std::size_t i = 0; i < static_cast<std::size_t>(size); ++i)
    {
      const double vertical = 2e3 + 18e3 * static_cast<double>(i) / size;
      for (std::size_t k = 0; k < n_stress<D>; ++k)
      {
        stress[k].push_back(k == 1 ? -vertical : k < 3 ? -0.5 * vertical : 0.0);
        strain[k].push_back(1e-5 * normal(random) * (D == 2 && k == 2 ? 0 : 1) + (k == 3 ? 4e-5 : 0));
      }
      const double mean = (strain[0][i] + strain[1][i] + strain[2][i]) / D;
      for (std::size_t k = 0; k < D; ++k) // volume changes little
        strain[k][i] -= 0.95 * mean;
    }
    for (auto& state : states)
      state.assign(static_cast<std::size_t>(size), 0.0);
    if (std::holds_alternative<CamClay>(law) ||
        std::holds_alternative<NorSand>(law)) // state 1 is ln of the largest pressure over that of the law
      for (std::size_t i = 0; i < static_cast<std::size_t>(size); ++i)
        states[1][i] = std::log(static_cast<double>(i + 100) / (size + 100));
    cell_size.assign(static_cast<std::size_t>(size), 0.25);
  }

  PointBatch<D> batch()
  {
    PointBatch<D> points;
    points.size = size;
    for (std::size_t k = 0; k < n_stress<D>; ++k)
    {
      points.strain_increment[k] = strain[k].data();
      points.stress[k] = stress[k].data();
    }
    columns.clear();
    for (auto& state : states)
      columns.push_back(state.data());
    points.state = columns.data();
    points.dt = 1e-3;
    points.cell_size = cell_size.data();
    return points;
  }

  void reverse()
  {
    for (auto& column : strain)
      for (double& entry : column)
        entry = -entry;
  }

  std::array<std::vector<double>, n_stress<D>> stress, strain;
  std::vector<std::vector<double>> states;
  std::vector<double*> columns;
  std::vector<double> cell_size;
};

/// What is counted
template <int D>
[[gnu::noinline]] BatchReport measured(const Law& law, const PointBatch<D>& points)
{
  return update<D>(law, points);
}

template <int D>
void run(const Law& law, bool yields, int repeats)
{
  Ground<D> ground(law);
  if (yields)
    for (int step = 0; step < steps_before; ++step)
      update<D>(law, ground.batch());
  Index plastic = 0;
  std::size_t failed = 0;
  const auto start = std::chrono::steady_clock::now();
  for (int step = 0; step < repeats * steps; ++step)
  {
    if (!yields)
      ground.reverse();
    const BatchReport report = measured<D>(law, ground.batch());
    plastic += report.plastic;
    failed += report.failed.size();
  }
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
  const double points = static_cast<double>(size) * steps * repeats;
  std::printf("points %.0f plastic %.4f failed %zu ns %.1f\n", points, plastic / points, failed,
              1e9 * time.count() / points);
}
} // namespace

int main(int argc, char** argv)
{
  if (argc < 4)
    return 1;
  const bool yields = std::string_view(argv[2]) == "plastic";
  const Law law = law_of(argv[1], yields);
  const int repeats = argc > 4 ? std::atoi(argv[4]) : 1;
  argv[3][0] == '2' ? run<2>(law, yields, repeats) : run<3>(law, yields, repeats);
}
