#pragma once
/// @file
/// Principal stresses and directions of a stress, and back. Free of branches and inline: loops over points vectorise.

#include "materials/mohr_coulomb_return.h"

namespace mpm::mohr_coulomb
{
/// Principal directions of a stress
template <int D>
struct Frame;

/// Plane strain: zz is a principal direction, the other two turn in the plane
template <>
struct Frame<2>
{
  double cos2, sin2;    ///< of twice the angle from x to the major of the two directions in the plane
  std::int64_t zz_rank; ///< 0 where zz is s1, 1 where it is s2, 2 where it is s3
};

/// A unit vector, or any vector
struct Direction
{
  double x, y, z;
};

template <>
struct Frame<3>
{
  Direction n1, n2, n3; ///< unit vectors of s1, s2, s3
};

/// Principal stresses and directions
template <int D>
struct Spectral
{
  Principal stress;
  Frame<D> frame;
};

inline Direction select(bool first, Direction a, Direction b)
{
  return {first ? a.x : b.x, first ? a.y : b.y, first ? a.z : b.z};
}

inline Spectral<2> spectral(const SymTensor<2>& stress)
{
  const double centre = 0.5 * (stress[0] + stress[1]);
  const double half_difference = 0.5 * (stress[0] - stress[1]);
  const double radius = std::sqrt(half_difference * half_difference + stress[3] * stress[3]);
  const double major = centre + radius, minor = centre - radius, zz = stress[2];
  const bool zz_first = zz > major, zz_last = zz < minor;
  const Principal principal{zz_first ? zz : major, zz_first ? major : (zz_last ? minor : zz), zz_last ? zz : minor};
  const double cos2 = radius > 0 ? half_difference / radius : 1.0;
  const double sin2 = radius > 0 ? stress[3] / radius : 0.0;
  return {principal, {cos2, sin2, zz_first ? 0 : (zz_last ? 2 : 1)}};
}

inline SymTensor<2> recomposed(Principal s, Frame<2> frame)
{
  const bool zz_first = frame.zz_rank == 0, zz_last = frame.zz_rank == 2;
  const double major = zz_first ? s.s2 : s.s1;
  const double minor = zz_last ? s.s2 : s.s3;
  const double zz = zz_first ? s.s1 : (zz_last ? s.s3 : s.s2);
  const double centre = 0.5 * (major + minor), radius = 0.5 * (major - minor);
  return {centre + radius * frame.cos2, centre - radius * frame.cos2, zz, radius * frame.sin2};
}

/// One Jacobi rotation, in the plane of the axes p and q, of the symmetric matrix with the entries pp, qq, pq and, with
/// the third axis, pr and qr; it makes pq zero. The columns p and q of the eigenvectors turn along.
/// Source: Golub, Van Loan (2013), Matrix Computations, section 8.5.2.
[[gnu::always_inline]] inline void rotate(double& pp, double& qq, double& pq, double& pr, double& qr, Direction& p,
                                          Direction& q)
{
  const double difference = qq - pp;
  const double root = std::sqrt(difference * difference + 4 * pq * pq);
  const double denominator = std::abs(difference) + root + std::numeric_limits<double>::min(); // 0 / 0 gives 0
  const double tangent = (difference < 0 ? -2 : 2) * pq / denominator;
  const double cosine = 1 / std::sqrt(1 + tangent * tangent), sine = tangent * cosine;
  pp -= tangent * pq;
  qq += tangent * pq;
  pq = 0;
  const double old_pr = pr;
  pr = cosine * old_pr - sine * qr;
  qr = sine * old_pr + cosine * qr;
  const Direction old_p = p;
  p = {cosine * p.x - sine * q.x, cosine * p.y - sine * q.y, cosine * p.z - sine * q.z};
  q = {sine * old_p.x + cosine * q.x, sine * old_p.y + cosine * q.y, sine * old_p.z + cosine * q.z};
}

/// Eigenvalues and eigenvectors by cyclic Jacobi rotations. Unlike closed forms they keep round-off accuracy where
/// eigenvalues come close. Their convergence is cubic in the end, so that a fixed number of sweeps will do: four left
/// an error of 2e-15 at most in 6e7 random matrices, graded and nearly repeated ones among them (three left 2e-5).
[[gnu::always_inline]] inline Spectral<3> spectral(const SymTensor<3>& stress)
{
  double xx = stress[0], yy = stress[1], zz = stress[2], xy = stress[3], yz = stress[4], xz = stress[5];
  Direction a{1, 0, 0}, b{0, 1, 0}, c{0, 0, 1};
#pragma GCC unroll 8
  for (int sweep = 0; sweep < 4; ++sweep)
  {
    rotate(xx, yy, xy, xz, yz, a, b);
    rotate(xx, zz, xz, xy, yz, a, c);
    rotate(yy, zz, yz, xy, xz, b, c);
  }
  const auto sort = [](double& larger, double& smaller, Direction& n_larger, Direction& n_smaller)
  {
    const bool sorted = larger >= smaller;
    const double value = larger;
    const Direction n = n_larger;
    larger = sorted ? value : smaller;
    smaller = sorted ? smaller : value;
    n_larger = select(sorted, n, n_smaller);
    n_smaller = select(sorted, n_smaller, n);
  };
  sort(xx, yy, a, b);
  sort(yy, zz, b, c);
  sort(xx, yy, a, b);
  return {{xx, yy, zz}, {a, b, c}};
}

inline SymTensor<3> recomposed(Principal s, Frame<3> frame)
{
  const Direction a = frame.n1, b = frame.n2, c = frame.n3;
  return {
      s.s1 * a.x * a.x + s.s2 * b.x * b.x + s.s3 * c.x * c.x, s.s1 * a.y * a.y + s.s2 * b.y * b.y + s.s3 * c.y * c.y,
      s.s1 * a.z * a.z + s.s2 * b.z * b.z + s.s3 * c.z * c.z, s.s1 * a.x * a.y + s.s2 * b.x * b.y + s.s3 * c.x * c.y,
      s.s1 * a.y * a.z + s.s2 * b.y * b.z + s.s3 * c.y * c.z, s.s1 * a.x * a.z + s.s2 * b.x * b.z + s.s3 * c.x * c.z};
}

/// Whether a stress may be outside the surface. In plane strain the answer is exact.
inline bool may_yield(const Surface& m, const SymTensor<2>& stress)
{
  const Principal s = spectral(stress).stress;
  return is_outside(m, s.s1, s.s3);
}

/// In three dimensions the answer errs on the side of yes, by 1e-6 of the stress: the extreme principal stresses are
/// found from the invariants, x = cos(theta) by two Newton steps on 4 x^3 - 3 x = |cos(3 theta)|, exact to 1e-8 and far
/// cheaper than the eigenvectors.
/// Source of the invariants: de Souza Neto, Peric, Owen (2008), box A.2 and eq. (8.16).
[[gnu::always_inline]] inline bool may_yield(const Surface& m, const SymTensor<3>& stress)
{
  const double mean = (stress[0] + stress[1] + stress[2]) / 3;
  const double xx = stress[0] - mean, yy = stress[1] - mean, zz = stress[2] - mean;
  const double xy = stress[3], yz = stress[4], xz = stress[5];
  const double third_j2 = (0.5 * (xx * xx + yy * yy + zz * zz) + xy * xy + yz * yz + xz * xz) / 3;
  const double j3 = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
  const double radius = std::sqrt(third_j2);
  const double cube = 2 * third_j2 * radius + std::numeric_limits<double>::min(); // 0 / 0 gives 0
  const double ratio = std::abs(j3) / cube;
  const double cos_triple = ratio < 1 ? ratio : 1.0;
  double x = 0.8660254037844386 + 0.1339745962155614 * cos_triple; // exact at theta = 0 and 30 degrees
  for (int newton = 0; newton < 2; ++newton)
    x -= ((4 * x * x - 3) * x - cos_triple) / (12 * x * x - 3);
  const double pair = 1 - x * x;
  const double y = 0.5 * (x + std::sqrt(3 * (pair > 0 ? pair : 0.0)));
  const double s1 = mean + 2 * radius * (j3 >= 0 ? x : y);
  const double s3 = mean - 2 * radius * (j3 >= 0 ? y : x);
  const double margin = 1e-6 * (std::abs(s1) + std::abs(s3) + m.cohesion_cos);
  return (yield(m, s1, s3) > -margin) | (s1 - m.tension > -margin);
}
} // namespace mpm::mohr_coulomb
