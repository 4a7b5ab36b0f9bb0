#pragma once
/// @file
/// Return of one trial stress to the Mohr-Coulomb surface, in principal stresses.
///
/// In sorted principal stresses every surface is a plane, so each return is a linear map and each region of trial
/// stresses is bounded by planes: no iteration. Every function here is free of branches and inline: the same code
/// serves a single point and, in a `#pragma omp simd` loop, eight at once.
///
/// Sources: Clausen, Damkilde, Andersen (2006), IJNME 66, 1967-1989 (regions in principal stresses; the boundary of a
/// plane's region contains its flow direction and an edge); (2007), Comput. Struct. 85, 1795-1807 (non-associated flow,
/// apex); de Souza Neto, Peric, Owen (2008), Computational Methods for Plasticity, section 8.2 (plane, edges, apex).

#include "materials/tools/elasticity.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

namespace mpm::materials::mohr_coulomb
{
/// Principal stresses, s1 >= s2 >= s3
struct Principal
{
  double s1, s2, s3;
};

/// The part of the surface that a stress was returned to. As wide as a stress, so that selections vectorise.
enum class Region : std::int64_t
{
  elastic,            ///< inside, no return
  plane,              ///< s1 > s2 > s3
  compression_edge,   ///< s1 = s2, the meridian of triaxial compression
  extension_edge,     ///< s2 = s3, the meridian of triaxial extension
  apex,               ///< s1 = s2 = s3
  tension_plane,      ///< s1 at the cut-off
  tension_edge,       ///< s1 = s2 at the cut-off
  tension_apex,       ///< all three at the cut-off
  shear_tension,      ///< the line where plane and tension plane meet
  compression_corner, ///< the point where compression edge and cut-off meet
  extension_corner,   ///< the point where extension edge and cut-off meet
};
inline constexpr std::size_t n_regions = 11;

/// A Mohr-Coulomb material with the constants of its returns worked out
struct Surface
{
  ElasticModuli moduli;
  double poisson;
  double cohesion_cos; ///< c cos(phi) [Pa]
  double sin_phi, sin_psi;
  double slope;    ///< N = (1 + sin(phi)) / (1 - sin(phi)); on the surface s3 = N s1 - strength
  double strength; ///< uniaxial compressive strength 2 c sqrt(N) [Pa]
  double apex;     ///< c cot(phi) [Pa], infinite for phi = 0
  double tension;  ///< tension cut-off [Pa], infinite where the apex comes first
  // Returns to an edge keep a weighted sum of the principal stresses: the plastic strain is normal to the edge of the
  // potential, so with it as r_b the sum is r_b . D^-1 sigma, scaled by 3K to stay finite as poisson nears 0.5.
  // The weights are over the sum on the edge per s1.
  double compression_w12, compression_w3; ///< of s1 and s2, of s3
  double extension_w1, extension_w23;     ///< of s1, of s2 and s3
  // Divisions that need not be done for each stress:
  double per_plane_stiffness;     ///< plastic multiplier per excess of the yield function [1/Pa]
  double lateral;                 ///< poisson / (1 - poisson)
  double plastic_per_root_square; ///< sqrt(2) / 6G [1/Pa]
};

/// Friction angle phi and dilation angle psi of a material, by what enters its constants
struct Angles
{
  double sin_phi, cos_phi, sin_psi;
};

/// The constants of a material
[[gnu::always_inline]] inline Surface surface(const ElasticModuli& moduli, double poisson, double cohesion,
                                              Angles angles, double tension_cutoff)
{
  constexpr double infinity = std::numeric_limits<double>::infinity(), third = 1.0 / 3;
  Surface s{};
  s.moduli = moduli;
  s.poisson = poisson;
  s.sin_phi = angles.sin_phi;
  s.sin_psi = angles.sin_psi;
  s.cohesion_cos = cohesion * angles.cos_phi;
  const double per_rest = 1 / (1 - s.sin_phi); // divisions are what this takes longest for
  const double n = (1 + s.sin_phi) * per_rest;
  const double m = (1 + s.sin_psi) / (1 - s.sin_psi);
  s.slope = n;
  s.strength = 2 * s.cohesion_cos * per_rest;
  s.apex = s.sin_phi > 0 ? s.cohesion_cos / s.sin_phi : infinity;
  s.tension = tension_cutoff < s.apex ? tension_cutoff : infinity;
  // Edges of the potential: (1, 1, m) and (1, m, m), split into mean and deviator.
  const double stiffness_ratio = (1 + poisson) / (1 - 2 * poisson); // 3K / 2G
  const double deviator = stiffness_ratio * (m - 1) * third;
  const double compression_mean = (2 + m) * third, extension_mean = (1 + 2 * m) * third;
  const double per_compression = 1 / (compression_mean * (2 + n) + 2 * deviator * (n - 1));
  s.compression_w12 = (compression_mean - deviator) * per_compression;
  s.compression_w3 = (compression_mean + 2 * deviator) * per_compression;
  const double per_extension = 1 / (extension_mean * (1 + 2 * n) + 2 * deviator * (n - 1));
  s.extension_w1 = (extension_mean - 2 * deviator) * per_extension;
  s.extension_w23 = (extension_mean + deviator) * per_extension;
  s.per_plane_stiffness = 1 / (moduli.shear + (moduli.lambda + moduli.shear) * s.sin_phi * s.sin_psi);
  s.lateral = poisson / (1 - poisson);
  s.plastic_per_root_square = std::numbers::sqrt2 / (6 * moduli.shear);
  return s;
}

/// The constants of a material; angles in radians
inline Surface surface(const ElasticModuli& moduli, double poisson, double cohesion, double phi, double psi,
                       double tension_cutoff)
{
  return surface(moduli, poisson, cohesion, Angles{std::sin(phi), std::cos(phi), std::sin(psi)}, tension_cutoff);
}

/// Mohr-Coulomb yield function [Pa], as a shear stress; positive outside
inline double yield(const Surface& m, double s1, double s3)
{
  return 0.5 * (s1 - s3) + 0.5 * (s1 + s3) * m.sin_phi - m.cohesion_cos;
}

/// Whether a stress with these extreme principal stresses is outside by more than round-off, so that a stress that was
/// returned counts as elastic when it is updated again
inline bool is_outside(const Surface& m, double s1, double s3)
{
  const double tolerance = 1e-12 * (std::abs(s1) + std::abs(s3) + m.cohesion_cos);
  return (yield(m, s1, s3) > tolerance) | (s1 - m.tension > tolerance);
}

inline Principal select(bool first, Principal a, Principal b)
{
  return {first ? a.s1 : b.s1, first ? a.s2 : b.s2, first ? a.s3 : b.s3};
}

/// Return along the flow of the main plane; the result may be unsorted, then another region holds
inline Principal on_plane(const Surface& m, Principal t)
{
  const double bulk = m.moduli.lambda + m.moduli.shear; // in the plane of s1 and s3
  const double multiplier = yield(m, t.s1, t.s3) * m.per_plane_stiffness;
  const double centre = 0.5 * (t.s1 + t.s3) - bulk * m.sin_psi * multiplier;
  const double radius = m.cohesion_cos - centre * m.sin_phi;
  return {centre + radius, t.s2 - m.moduli.lambda * m.sin_psi * multiplier, centre - radius};
}

/// Return to s1 = s2; beyond the apex where the result exceeds it
inline Principal on_compression_edge(const Surface& m, Principal t)
{
  const double s1 = m.compression_w12 * (t.s1 + t.s2) + m.compression_w3 * (t.s3 + m.strength);
  return {s1, s1, m.slope * s1 - m.strength};
}

/// Return to s2 = s3; beyond the apex where the result exceeds it
inline Principal on_extension_edge(const Surface& m, Principal t)
{
  const double s1 = m.extension_w1 * t.s1 + m.extension_w23 * (t.s2 + t.s3 + 2 * m.strength);
  const double s3 = m.slope * s1 - m.strength;
  return {s1, s3, s3};
}

/// Return along the normal of the tension plane s1 = tension; s2 and s3 may still exceed the cut-off
inline Principal on_tension_plane(const Surface& m, Principal t)
{
  const double change = m.lateral * (t.s1 - m.tension);
  return {m.tension, t.s2 - change, t.s3 - change};
}

/// Return to s1 = s2 = tension; s3 may still exceed the cut-off
inline Principal on_tension_edge(const Surface& m, Principal t)
{
  return {m.tension, m.tension, t.s3 - m.poisson * (t.s1 + t.s2 - 2 * m.tension)};
}

/// Return to the line where main plane and tension plane meet; s2 may leave its place between s1 and s3
inline Principal on_shear_tension_line(const Surface& m, Principal t)
{
  const double s3 = m.slope * m.tension - m.strength;
  return {m.tension, t.s2 - m.poisson * (t.s1 + t.s3 - m.tension - s3), s3};
}

/// Where a trial stress was returned to
struct Returned
{
  Principal stress;
  Region region;
};

inline Returned select(bool first, Returned a, Returned b)
{
  return {select(first, a.stress, b.stress), first ? a.region : b.region};
}

/// Return to the shear surface alone, for a trial stress outside of it. Which region the trial stress lies in: see
/// Clausen et al. (2006), section 4: the boundary between plane and edge contains the flow direction of the plane, so
/// the return to the plane comes out unsorted beyond it; the boundary between edge and apex is where the return to the
/// edge reaches the apex.
inline Returned shear_return(const Surface& m, Principal trial)
{
  const Principal plane = on_plane(m, trial);
  const Principal compression = on_compression_edge(m, trial);
  const Principal extension = on_extension_edge(m, trial);
  const bool beyond_compression = plane.s2 > plane.s1;
  const bool beyond_extension = plane.s2 < plane.s3;
  Returned result{{m.apex, m.apex, m.apex}, Region::apex};
  result = select(beyond_extension & (extension.s1 < m.apex), {extension, Region::extension_edge}, result);
  result = select(beyond_compression & (compression.s1 < m.apex), {compression, Region::compression_edge}, result);
  return select(!beyond_compression & !beyond_extension, {plane, Region::plane}, result);
}

/// Return to the tension planes alone, for a trial stress with s1 above the cut-off
inline Returned tension_return(const Surface& m, Principal trial)
{
  const Principal plane = on_tension_plane(m, trial);
  const Principal edge = on_tension_edge(m, trial);
  Returned result{{m.tension, m.tension, m.tension}, Region::tension_apex};
  result = select(edge.s3 <= m.tension, {edge, Region::tension_edge}, result);
  return select(plane.s2 <= m.tension, {plane, Region::tension_plane}, result);
}

/// Return to the intersection of shear and tension surfaces
inline Returned shear_tension_return(const Surface& m, Principal trial)
{
  const Principal line = on_shear_tension_line(m, trial);
  const Principal compression{m.tension, m.tension, line.s3};
  const Principal extension{m.tension, line.s3, line.s3};
  Returned result{line, Region::shear_tension};
  result = select(line.s2 > m.tension, {compression, Region::compression_corner}, result);
  return select(line.s2 < line.s3, {extension, Region::extension_corner}, result);
}

/// Return of a trial stress. The multipliers of the planes solve a linear complementarity problem with a P-matrix (for
/// psi <= phi), so the solution is unique: where the return to the surfaces of one kind respects the other kind, it is
/// the one. An infinite cut-off needs no case of its own: all of its returns are passed over.
/// @tparam with_cutoff  may be false where the cut-off is infinite, which saves a sixth of the time in plane strain
template <bool with_cutoff = true>
[[gnu::always_inline]] inline Returned return_to_surface(const Surface& m, Principal trial)
{
  const Returned elastic{trial, Region::elastic};
  Returned result = select(yield(m, trial.s1, trial.s3) > 0, shear_return(m, trial), elastic);
  if constexpr (with_cutoff)
  {
    const Returned tension = tension_return(m, trial);
    const bool tension_holds = (trial.s1 > m.tension) & (yield(m, tension.stress.s1, tension.stress.s3) <= 0);
    const Returned other = select(tension_holds, tension, shear_tension_return(m, trial));
    result = select(result.stress.s1 <= m.tension, result, other);
  }
  return select(is_outside(m, trial.s1, trial.s3), result, elastic);
}

/// By how much the mean of the trial stress is beyond the apex, or the tension cut-off in all directions [Pa]; over the
/// bulk modulus it is the volumetric strain by which the return pulls the soil apart. Zero in all other regions.
inline double tension_beyond_apex(Principal trial, Returned returned)
{
  const bool apart = (returned.region == Region::apex) | (returned.region == Region::tension_apex);
  return apart ? (trial.s1 + trial.s2 + trial.s3) * (1.0 / 3) - returned.stress.s1 : 0.0;
}

/// Accumulated plastic deviatoric strain of a return, sqrt(2/3 e : e) with e the deviatoric plastic strain
inline double deviatoric_plastic_strain(const Surface& m, Principal trial, Principal stress)
{
  const double d1 = trial.s1 - stress.s1, d2 = trial.s2 - stress.s2, d3 = trial.s3 - stress.s3;
  const double squares = (d1 - d2) * (d1 - d2) + (d2 - d3) * (d2 - d3) + (d3 - d1) * (d3 - d1);
  return std::sqrt(squares) * m.plastic_per_root_square; // 2/3 dev : dev = 2/9 squares, and dev = 2 G e
}
} // namespace mpm::materials::mohr_coulomb
