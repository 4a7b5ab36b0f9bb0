#include "materials/laws/association.h"

namespace mpm::materials
{
namespace
{
bool non_associated(const LinearElastic&) { return false; }
bool non_associated(const CamClay&) { return false; }
bool non_associated(const ExternalLaw&) { return true; }
bool non_associated(const Umat&) { return true; }
bool non_associated(const MohrCoulomb& law) { return law.dilation_angle < law.friction_angle; }
bool non_associated(const DruckerPrager& law) { return law.dilation < law.friction; }
bool non_associated(const ViscoplasticMohrCoulomb& law) { return non_associated(law.inviscid); }
bool non_associated(const SofteningMohrCoulomb& law) { return non_associated(law.peak); }

// The pressure of its water is most of what averages change, and its strength does not depend on that.
bool non_associated(const Undrained&) { return false; }

bool non_associated(const Heterogeneous& law);
bool non_associated(const Hencky& law);

template <class... L>
bool non_associated(const std::variant<L...>& law)
{
  return std::visit([](const auto& one) { return non_associated(one); }, law);
}

bool non_associated(const Heterogeneous& law) { return non_associated(law.law); }
bool non_associated(const Hencky& law) { return non_associated(law.law); }
} // namespace

bool is_non_associated(const Law& law) { return non_associated(law); }
} // namespace mpm::materials
