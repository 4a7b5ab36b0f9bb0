#include "materials/laws/external_law.h"

#include "materials/tools/require.h"

#include <cmath>

namespace mpm::materials
{
void check(const ExternalLaw& law)
{
  require(!law.names.empty() && law.names.size() < max_states, "n_state", static_cast<double>(law.names.size()),
          "from 1 to 63");
  require(law.wave_modulus > 0 && std::isfinite(law.wave_modulus), "p_wave_modulus", law.wave_modulus,
          "positive and finite [Pa]");
}
} // namespace mpm::materials
