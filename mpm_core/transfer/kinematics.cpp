#include "transfer/kinematics.h"

#include "mesh/search.h"

#include <algorithm>
#include <cmath>

namespace mpm
{
template <int D>
int move_particles(Particles<D>& particles, const Run& run, const NodalMotion<D>& motion, double dt, double pic_share)
{
  const CellShape<D> shape = motion.mesh.shapes[run.cell];
  const auto nodal = [](const auto& values) { return [&values](Index i) -> const Vector<D>& { return values[i]; }; };
  AffineField<D> change = affine_field<D>(motion.mesh, run.cell, nodal(motion.acceleration));
  const AffineField<D> velocity = affine_field<D>(motion.mesh, run.cell, nodal(motion.velocity));
  // v_p becomes (1 - pic) v_p + change(x_p): FLIP where pic is 0.
  const double keep = 1 - pic_share;
  for (int a = 0; a < D; ++a)
  {
    change.value[a] *= dt;
    for (int b = 0; b < D; ++b)
      change.gradient[a][b] *= dt;
  }
  if (pic_share > 0)
  {
    const AffineField<D> start = affine_field<D>(motion.mesh, run.cell, nodal(motion.start_velocity));
    for (int a = 0; a < D; ++a)
    {
      change.value[a] += pic_share * start.value[a];
      for (int b = 0; b < D; ++b)
        change.gradient[a][b] += pic_share * start.gradient[a][b];
    }
  }

  double *x[D], *v[D];
  for (int i = 0; i < D; ++i)
  {
    x[i] = particles.position[i].data();
    v[i] = particles.velocity[i].data();
  }
  int outside = 0;
#pragma omp simd reduction(+ : outside)
  for (Index p = run.first; p < run.last; ++p)
  {
    double xi[D];
    for (int i = 0; i < D; ++i)
      xi[i] = x[i][p] - shape.centre[i];
    double moved[D];
    for (int a = 0; a < D; ++a)
    {
      double dv = change.value[a], u = velocity.value[a];
      for (int b = 0; b < D; ++b)
      {
        dv += change.gradient[a][b] * xi[b];
        u += velocity.gradient[a][b] * xi[b];
      }
      v[a][p] = keep * v[a][p] + dv;
      x[a][p] += dt * u;
      moved[a] = x[a][p] - shape.centre[a];
    }
    bool inside = true; // false also where a coordinate is not a number
    for (int k = 0; k <= D; ++k)
    {
      double n = 1.0 / (D + 1);
      for (int i = 0; i < D; ++i)
        n += shape.gradient[k][i] * moved[i];
      inside &= n >= -inside_tolerance;
    }
    outside += inside ? 0 : 1;
  }
  return outside;
}

namespace
{
template <int D>
double deviatoric_size(const SymTensor<D>& e, double volumetric)
{
  double normal = 0, shear = 0;
  for (int k = 0; k < 3; ++k)
    normal += (e[k] - volumetric / 3) * (e[k] - volumetric / 3);
  for (int k = 3; k < n_stress<D>; ++k)
    shear += e[k] * e[k];
  return std::sqrt(2.0 / 3.0 * (normal + 0.5 * shear));
}
} // namespace

template <int D>
CellStrain<D> strain_increment(const Matrix<D>& velocity_gradient, double dt)
{
  CellStrain<D> strain{};
  Matrix<D> spin;
  double half_angle_squared = 0;
  for (int i = 0; i < D; ++i)
  {
    strain.increment[i] = dt * velocity_gradient[i][i];
    strain.volumetric += strain.increment[i];
    for (int j = 0; j < D; ++j)
      spin[i][j] = 0.25 * dt * (velocity_gradient[i][j] - velocity_gradient[j][i]); // half of the step's rotation
    for (int j = 0; j < i; ++j)
      half_angle_squared += spin[i][j] * spin[i][j];
  }
  for (int k = D; k < n_symmetric<D>; ++k)
  {
    const auto [i, j] = symmetric_pairs<D>[k];
    strain.increment[stress_component<D>[k]] = dt * (velocity_gradient[i][j] + velocity_gradient[j][i]);
  }
  strain.deviatoric = deviatoric_size<D>(strain.increment, strain.volumetric);

  // (1 - W)^-1 (1 + W) = 1 + 2 (W + W W) / (1 + |w|^2) for the antisymmetric W of axial vector w
  const double scale = 2 / (1 + half_angle_squared);
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
    {
      double square = 0;
      for (int k = 0; k < D; ++k)
        square += spin[i][k] * spin[k][j];
      strain.rotation[i][j] = (i == j ? 1.0 : 0.0) + scale * (spin[i][j] + square);
    }
  return strain;
}

template <int D>
void set_volumetric(CellStrain<D>& strain, double volumetric)
{
  const double change = (volumetric - strain.volumetric) / D;
  for (int i = 0; i < D; ++i)
    strain.increment[i] += change;
  strain.volumetric = volumetric;
  strain.deviatoric = deviatoric_size<D>(strain.increment, volumetric);
}

template <int D>
void rotate(const SymmetricColumns<D>& stress, Index first, Index last, const Matrix<D>& rotation)
{
  constexpr int S = n_symmetric<D>;
  double* s[S];
  std::copy(stress.begin(), stress.end(), s);
  const Matrix<D> r = rotation;
#pragma omp simd
  for (Index p = first; p < last; ++p)
  {
    double half[D][D]; // R sigma
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j)
      {
        half[i][j] = 0;
        for (int k = 0; k < D; ++k)
          half[i][j] += r[i][k] * s[symmetric_index<D>(k, j)][p];
      }
    double turned[S];
    for (int k = 0; k < S; ++k)
    {
      turned[k] = 0;
      for (int j = 0; j < D; ++j)
        turned[k] += half[symmetric_pairs<D>[k][0]][j] * r[symmetric_pairs<D>[k][1]][j];
    }
    for (int k = 0; k < S; ++k)
      s[k][p] = turned[k];
  }
}

template <int D>
void strain_particles(Particles<D>& particles, Index first, Index last, const CellStrain<D>& strain)
{
  SymmetricColumns<D> stress;
  for (int k = 0; k < n_symmetric<D>; ++k)
    stress[k] = particles.stress[stress_component<D>[k]].data();
  rotate<D>(stress, first, last, strain.rotation);
  double* const volume = particles.volume.data();
  double* const deviatoric = particles.deviatoric_strain.data();
  const double growth = 1 + strain.volumetric, increment = strain.deviatoric;
#pragma omp simd
  for (Index p = first; p < last; ++p)
  {
    volume[p] *= growth;
    deviatoric[p] += increment;
  }
}

#define INSTANTIATE(D)                                                                                                 \
  template int move_particles(Particles<D>&, const Run&, const NodalMotion<D>&, double, double);                       \
  template CellStrain<D> strain_increment<D>(const Matrix<D>&, double);                                                   \
  template void set_volumetric(CellStrain<D>&, double);                                                                \
  template void rotate<D>(const SymmetricColumns<D>&, Index, Index, const Matrix<D>&);                                 \
  template void strain_particles(Particles<D>&, Index, Index, const CellStrain<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
