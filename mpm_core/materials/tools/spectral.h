#pragma once
/// @file
/// Principal stresses and directions of a stress, and back. Free of branches and inline: loops over points vectorise.

#include "materials/laws/mohr_coulomb_return.h"

namespace mpm::materials::mohr_coulomb
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

/// The deviator of a stress in three dimensions, by its invariants: its principal values are 2 r cos(theta + k 120
/// degrees), of which 2 r x, x = cos(theta) with theta from 0 to 30 degrees, is the one farthest from the others, up to
/// its sign. It is found by Newton steps on 4 x^3 - 3 x = |cos(3 theta)|, which is well conditioned there.
/// Source: de Souza Neto, Peric, Owen (2008), box A.2 and eq. (8.16).
struct Invariants
{
  double radius; ///< r = sqrt(J2 / 3)
  double x;
  double sign; ///< of J3: 1 where the value farthest from the others is the largest, -1 where it is the smallest
};

/// @param newton_steps  one leaves an error of 2e-9 in all values, two one of round-off
template <int newton_steps>
[[gnu::always_inline]] inline Invariants invariants(const SymTensor<3>& deviator)
{
  const auto [xx, yy, zz, xy, yz, xz] = deviator;
  const double third_j2 = (0.5 * (xx * xx + yy * yy + zz * zz) + xy * xy + yz * yz + xz * xz) * (1.0 / 3);
  const double j3 = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
  const double radius = std::sqrt(third_j2);
  const double ratio = std::abs(j3) / (2 * third_j2 * radius + std::numeric_limits<double>::min()); // 0 / 0 gives 0
  const double cos_triple = ratio < 1 ? ratio : 1.0;
  // Interpolates cos(acos(.) / 3) to 2e-5, and exactly at 1, near which the other two values depend on the root of 1 -
  // x.
  double x = 0.01254096116225 - 0.00322127726477 * cos_triple;
  x = (x * cos_triple - 0.03217683284160) * cos_triple + 0.13395883669544;
  x = 1 - (1 - cos_triple) * x;
#pragma GCC unroll 2
  for (int step = 0; step < newton_steps; ++step)
    x -= ((4 * x * x - 3) * x - cos_triple) / (12 * x * x - 3);
  return {radius, x, j3 >= 0 ? 1.0 : -1.0};
}

/// The direction of the value `lambda` of a matrix that is far from its others: the longest column of the adjugate of
/// A - lambda 1, which is a multiple of n n^T. Any direction where all values are the same.
[[gnu::always_inline]] inline Direction direction_of(const SymTensor<3>& matrix, double lambda)
{
  const double xx = matrix[0] - lambda, yy = matrix[1] - lambda, zz = matrix[2] - lambda;
  const double xy = matrix[3], yz = matrix[4], xz = matrix[5];
  const double a = yy * zz - yz * yz, b = xx * zz - xz * xz, c = xx * yy - xy * xy;
  const double ab = xz * yz - xy * zz, ac = xy * yz - xz * yy, bc = xy * xz - xx * yz;
  Direction n = select(a >= b, Direction{a, ab, ac}, Direction{ab, b, bc});
  n = select((c >= a) & (c >= b), Direction{ac, bc, c}, n);
  const double size = std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
  const bool any = !(size > 0);
  const double per_size = 1 / size;
  return {any ? 1.0 : n.x * per_size, any ? 0.0 : n.y * per_size, any ? 0.0 : n.z * per_size};
}

/// n^T A m
[[gnu::always_inline]] inline double between(Direction n, const SymTensor<3>& a, Direction m)
{
  return n.x * (a[0] * m.x + a[3] * m.y + a[5] * m.z) + n.y * (a[3] * m.x + a[1] * m.y + a[4] * m.z) +
         n.z * (a[5] * m.x + a[4] * m.y + a[2] * m.z);
}

/// Principal stresses and directions. The value farthest from the others comes first, by the invariants, with its
/// direction; the other two, however close, by one rotation in the plane that is left, which is exact. Values are then
/// those of the directions found, so that errors of directions count twice over only. The error is that of round-off:
/// 2e-15 of the largest entry at most in 2e7 random matrices, graded and nearly repeated ones among them.
/// Sources: Eberly (2021), A robust eigensolver for 3x3 symmetric matrices; Duff et al. (2017), JCGT 6, 1-8 (the
/// plane).
[[gnu::always_inline]] inline Spectral<3> spectral(const SymTensor<3>& stress)
{
  const double mean = (stress[0] + stress[1] + stress[2]) * (1.0 / 3);
  SymTensor<3> deviator{stress[0] - mean, stress[1] - mean, stress[2] - mean, stress[3], stress[4], stress[5]};
  double size = 0;
  for (double entry : deviator)
    size = std::abs(entry) > size ? std::abs(entry) : size;
  const double per_size = size > 0 ? 1 / size : 0.0;
  for (double& entry : deviator)
    entry *= per_size; // of size one, so that no product over- or underflows
  const Invariants inv = invariants<2>(deviator);
  const Direction n = direction_of(deviator, 2 * inv.sign * inv.radius * inv.x);

  const double up = n.z >= 0 ? 1.0 : -1.0, w = -1 / (up + n.z), b = n.x * n.y * w;
  const Direction u{1 + up * n.x * n.x * w, up * b, -up * n.x}, v{b, up + n.y * n.y * w, -n.y};
  const double uu = between(u, deviator, u), vv = between(v, deviator, v), uv = between(u, deviator, v);
  const double difference = vv - uu;
  const double root = std::sqrt(difference * difference + 4 * uv * uv);
  const double denominator = std::abs(difference) + root + std::numeric_limits<double>::min(); // 0 / 0 gives 0
  const double tangent = (difference < 0 ? -2 : 2) * uv / denominator;
  const double cosine = 1 / std::sqrt(1 + tangent * tangent), sine = tangent * cosine;
  const Direction p{cosine * u.x - sine * v.x, cosine * u.y - sine * v.y, cosine * u.z - sine * v.z};
  const Direction q{sine * u.x + cosine * v.x, sine * u.y + cosine * v.y, sine * u.z + cosine * v.z};
  const double of_p = uu - tangent * uv, of_q = vv + tangent * uv, of_n = between(n, deviator, n);

  const bool p_first = of_p >= of_q, n_first = inv.sign > 0;
  const double major = p_first ? of_p : of_q, minor = p_first ? of_q : of_p;
  const Direction n_major = select(p_first, p, q), n_minor = select(p_first, q, p);
  const double s1 = n_first ? of_n : major, s2 = n_first ? major : minor, s3 = n_first ? minor : of_n;
  return {{mean + size * s1, mean + size * s2, mean + size * s3},
          {select(n_first, n, n_major), select(n_first, n_major, n_minor), select(n_first, n_minor, n)}};
}

inline SymTensor<3> recomposed(Principal s, Frame<3> frame)
{
  const Direction a = frame.n1, b = frame.n2, c = frame.n3;
  return {
      s.s1 * a.x * a.x + s.s2 * b.x * b.x + s.s3 * c.x * c.x, s.s1 * a.y * a.y + s.s2 * b.y * b.y + s.s3 * c.y * c.y,
      s.s1 * a.z * a.z + s.s2 * b.z * b.z + s.s3 * c.z * c.z, s.s1 * a.x * a.y + s.s2 * b.x * b.y + s.s3 * c.x * c.y,
      s.s1 * a.y * a.z + s.s2 * b.y * b.z + s.s3 * c.y * c.z, s.s1 * a.x * a.z + s.s2 * b.x * b.z + s.s3 * c.x * c.z};
}

/// Whether a stress may be outside the surface. In plane strain the result is exact.
inline bool may_yield(const Surface& m, const SymTensor<2>& stress)
{
  const Principal s = spectral(stress).stress;
  return is_outside(m, s.s1, s.s3);
}

/// In three dimensions the result errs towards true, by 1e-6 of the stress: the extreme principal stresses follow
/// from the invariants to 2e-9, far cheaper than with their directions.
[[gnu::always_inline]] inline bool may_yield(const Surface& m, const SymTensor<3>& stress)
{
  const double mean = (stress[0] + stress[1] + stress[2]) * (1.0 / 3);
  const auto [radius, x, sign] =
      invariants<1>({stress[0] - mean, stress[1] - mean, stress[2] - mean, stress[3], stress[4], stress[5]});
  const double pair = 1 - x * x;
  const double y = 0.5 * (x + std::sqrt(3 * (pair > 0 ? pair : 0.0)));
  const double s1 = mean + 2 * radius * (sign > 0 ? x : y);
  const double s3 = mean - 2 * radius * (sign > 0 ? y : x);
  const double margin = 1e-6 * (std::abs(s1) + std::abs(s3) + m.cohesion_cos);
  return (yield(m, s1, s3) > -margin) | (s1 - m.tension > -margin);
}
} // namespace mpm::materials::mohr_coulomb
