#pragma once
/// @file
/// The list of laws that stand for themselves, and what can be asked of any law. A new law is one file beside the
/// others and one entry here.

#include "materials/laws/cam_clay.h"
#include "materials/laws/drucker_prager.h"
#include "materials/laws/external_law.h"
#include "materials/laws/hardening_soil.h"
#include "materials/laws/hoek_brown.h"
#include "materials/laws/linear_elastic.h"
#include "materials/laws/mohr_coulomb.h"
#include "materials/laws/nor_sand.h"
#include "materials/laws/sanisand.h"
#include "materials/laws/softening_mohr_coulomb.h"
#include "materials/laws/umat.h"
#include "materials/laws/viscoplastic_mohr_coulomb.h"

#include <string>
#include <variant>

namespace mpm::materials
{
/// One of the laws that stand for themselves, or one of `Wrapper`, laws that are made of another one
template <class... Wrapper>
using LawList = std::variant<LinearElastic, MohrCoulomb, ViscoplasticMohrCoulomb, SofteningMohrCoulomb, DruckerPrager,
                             CamClay, NorSand, Sanisand, HardeningSoil, HoekBrown, ExternalLaw, Umat, Wrapper...>;

/// Throws InputError, with name, value and range, when a parameter of a law is out of its range.
template <class L>
requires requires { L::state_names; } &&(!requires { L::parts; }) void check(const L& law)
{
  check_parameters(law);
}

/// What a law is called in messages
template <class L>
requires requires { L::name; }
std::string law_name(const L&) { return std::string(L::name); }

/// Number of state variables of a law
template <class L>
requires requires { L::state_names; }
int n_state(const L&) { return static_cast<int>(L::state_names.size()); }

/// Names of a law's state variables, in their order; the first is `plastic_strain` in every law
template <class L>
requires requires { L::state_names; }
std::vector<std::string> state_names(const L&) { return {L::state_names.begin(), L::state_names.end()}; }

/// Shear modulus [Pa] of a law with Young's modulus and Poisson's ratio
template <class L>
requires requires(L law) { law.young + law.poisson; }
double shear_modulus(const L& law) { return law.young / (2 * (1 + law.poisson)); }

/// What a law needs of a batch beyond what all are given
template <class L>
requires requires { L::state_names; }
Needs needs(const L&)
{
  if constexpr (requires { L::special_needs; })
    return L::special_needs;
  else
    return {};
}

template <class... L>
Needs needs(const std::variant<L...>& law)
{
  return std::visit([](const auto& l) { return needs(l); }, law);
}

template <class... L>
std::string law_name(const std::variant<L...>& law)
{
  return std::visit([](const auto& l) { return law_name(l); }, law);
}

template <class... L>
int n_state(const std::variant<L...>& law)
{
  return std::visit([](const auto& l) { return n_state(l); }, law);
}

template <class... L>
std::vector<std::string> state_names(const std::variant<L...>& law)
{
  return std::visit([](const auto& l) { return state_names(l); }, law);
}

template <class... L>
void check(const std::variant<L...>& law)
{
  std::visit([](const auto& l) { check(l); }, law);
}

template <class... L>
double p_wave_modulus(const std::variant<L...>& law)
{
  return std::visit([](const auto& l) { return p_wave_modulus(l); }, law);
}

/// Shear modulus [Pa], or an estimate of its size where it changes or is not known
template <class... L>
double shear_modulus(const std::variant<L...>& law)
{
  return std::visit([](const auto& l) { return shear_modulus(l); }, law);
}

template <int D, class... L>
BatchReport update(const std::variant<L...>& law, const PointBatch<D>& points)
{
  return std::visit([&](const auto& l) { return update<D>(l, points); }, law);
}
} // namespace mpm::materials
