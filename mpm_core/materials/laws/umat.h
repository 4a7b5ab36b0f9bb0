#pragma once

#include "materials/laws/batch.h"
#include "materials/laws/strength_parameters.h"
#include "materials/tools/parameter.h"

namespace mpm::materials
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
/// (11 22 33 12 13 23), engineering shear as there. STRAN and the deformation gradient are kept among the states; the
/// increments of the latter multiply up to DFGRD0 and DFGRD1. STRESS and STRAN have been rotated with the material
/// before the call; DROT is that rotation, for tensors in STATEV, which the UMAT has to rotate. Both entries of TIME
/// are the time at the increment's start and DTIME is its duration; where loading is slow without limit (see
/// PointBatch::dt) DTIME is one. CELENT is the size of the point's cell, one where there is none. COORDS, TEMP and
/// fields are zero: a law that depends on temperature cannot be used. PNEWDT below one, or a stress that is not finite,
/// counts as a failure. NOEL is one and NPT the point's number in its batch, from one. Source: Abaqus User Subroutines
/// Reference Guide, UMAT.
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
  /// Numbers, from one, of the PROPS that are its strength, and what they stand for
  std::vector<std::pair<int, StrengthKind>> strength = {};

  static constexpr std::string_view name = "Umat";
  static constexpr auto parameters()
  {
    return std::array{parameter<Umat>("p_wave_modulus", entry<&Umat::wave_modulus>, "Pa", above<Umat>(0),
                                      "modulus of the compression wave, for the critical time step; an upper bound "
                                      "will do")};
  }
  static constexpr std::array parts{
      Part{"library", "path of the shared library, such as one made by ``gfortran -shared -fPIC -o umat.so umat.f``"},
      Part{"properties", "PROPS, a list of numbers"},
      Part{"n_variables", "NSTATV, a whole number from 0 to 55"},
      Part{"plastic_strain_variable",
           "number, from one, of the STATEV with the accumulated plastic deviatoric strain; 0 for none", false},
      Part{"symbol", "name of the subroutine in the library; ``umat_`` is what Fortran compilers make of UMAT", false},
      Part{"strength_parameters",
           "what the PROPS are that a factor of safety divides, by their numbers from one: ``{3: 'strength', "
           "4: 'friction angle', 5: 'dilation angle'}``, angles in degrees",
           false}};

  static constexpr Needs special_needs{.cell_size = true, .deformation = true};

  bool operator==(const Umat&) const = default;
};

/// The UMAT of a shared library, which stays loaded.
/// @param symbol  of the subroutine; `umat_` is what Fortran compilers make of UMAT
/// @throws InputError the library or the symbol is not there; with the loader's message
UmatFunction load_umat(const std::string& library, const std::string& symbol);

/// The file that a function of a shared library was loaded from.
std::string library_file(UmatFunction function);

/// plastic_strain, six components of STRAN (of which plane strain uses four), nine of the deformation gradient less the
/// identity (row by row), then STATEV
inline int n_state(const Umat& law) { return 16 + law.n_variables; }
inline Needs needs(const Umat&) { return Umat::special_needs; }
std::vector<std::string> state_names(const Umat& law);
inline double p_wave_modulus(const Umat& law) { return law.wave_modulus; }
/// Shear modulus for a Poisson's ratio of 1/4
inline double shear_modulus(const Umat& law) { return law.wave_modulus / 3; }

/// Kinds and values of the PROPS that are its strength.
std::pair<std::vector<StrengthKind>, std::vector<double>> named_strength(const Umat& law);

/// Throws InputError when a number is out of its range.
void check(const Umat& law);

/// Updates stress and state of a batch of points, one call of the UMAT each; DDSDDE is the tangent.
template <int D>
BatchReport update(const Umat& law, const PointBatch<D>& points);
} // namespace mpm::materials
