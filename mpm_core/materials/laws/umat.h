#pragma once

#include "materials/laws/batch.h"

namespace mpm
{
/// Arguments of Abaqus's subroutine UMAT, in its order; Fortran passes all by address, and the length of CMNAME last.
using UmatFunction = void (*)(double* stress, double* statev, double* ddsdde, double* sse, double* spd, double* scd,
                              double* rpl, double* ddsddt, double* drplde, double* drpldt, const double* stran,
                              const double* dstran, const double* time, const double* dtime, const double* temp,
                              const double* dtemp, const double* predef, const double* dpred, const char* cmname,
                              const int* ndi, const int* nshr, const int* ntens, const int* nstatv, const double* props,
                              const int* nprops, const double* coords, const double* drot, double* pnewdt,
                              const double* celent, const double* dfgrd0, const double* dfgrd1, const int* noel,
                              const int* npt, const int* layer, const int* kspt, const int* kstep, const int* kinc,
                              std::size_t cmname_length);

/// A law given as an Abaqus UMAT in a shared library, in Fortran or C.
///
/// Called with NDI = 3 and NSHR = 1 in plane strain, 3 in three dimensions; components are put in Abaqus's order
/// (11 22 33 12 13 23), engineering shear as there. STRAN is kept among the states. The stress has been turned with the
/// material before the call, so DROT and the deformation gradients are identities; TIME, COORDS, TEMP and fields are
/// zero and DTIME is one: a law that depends on rate or temperature cannot be used. PNEWDT below one, or a stress that
/// is not finite, counts as a failure. NOEL is one and NPT the point's number in its batch, from one.
/// Source: Abaqus User Subroutines Reference Guide, UMAT.
struct Umat
{
  UmatFunction function;
  /// PROPS
  std::vector<double> properties;
  /// NSTATV, at least 0
  int n_variables;
  /// Number, from one, of the STATEV that holds the accumulated plastic deviatoric strain; 0 for none
  int plastic_strain_variable;
  /// Modulus of the compression wave [Pa], for the critical time step
  double wave_modulus;
  /// Symbol, and a hash of the library's file as it was loaded: another one under the same name is another law
  std::string code = {};

  static constexpr std::string_view name = "Umat";

  bool operator==(const Umat&) const = default;
};

/// The UMAT of a shared library, which stays loaded.
/// @param symbol  of the subroutine; `umat_` is what Fortran compilers make of UMAT
/// @throws InputError the library or the symbol is not there; with the loader's message
UmatFunction load_umat(const std::string& library, const std::string& symbol);

/// The file that a function of a shared library was loaded from.
std::string library_file(UmatFunction function);

/// plastic_strain, six components of STRAN (of which plane strain uses four), then STATEV
inline int n_state(const Umat& law) { return 7 + law.n_variables; }
std::vector<std::string> state_names(const Umat& law);
inline double p_wave_modulus(const Umat& law) { return law.wave_modulus; }
/// That of a Poisson's ratio of 1/4
inline double shear_modulus(const Umat& law) { return law.wave_modulus / 3; }

/// Throws InputError when a number is out of its range.
void check(const Umat& law);

/// Updates stress and state of a batch of points, one call of the UMAT each; DDSDDE is the tangent.
template <int D>
BatchReport update(const Umat& law, const PointBatch<D>& points);
} // namespace mpm
