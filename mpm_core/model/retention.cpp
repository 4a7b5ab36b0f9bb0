#include "model/retention.h"

#include <algorithm>

namespace mpm::model
{
Wetness wetness_at(const Retention& retention, double pressure)
{
  const auto& s = retention.suction;
  if (pressure >= 0 || s.empty())
    return {};
  const double suction = -pressure;
  std::array<double, Retention::n_curves> value, slope{};
  if (suction >= s.back())
    for (std::size_t c = 0; c < value.size(); ++c)
      value[c] = retention.values[c].back();
  else
  {
    const auto above = static_cast<std::size_t>(std::ranges::upper_bound(s, suction) - s.begin());
    const double length = s[above] - s[above - 1], x = (suction - s[above - 1]) / length, y = 1 - x;
    for (std::size_t c = 0; c < value.size(); ++c)
    {
      const double a = retention.values[c][above - 1], b = retention.values[c][above];
      const double left = length * retention.slopes[c][above - 1], right = length * retention.slopes[c][above];
      value[c] = y * y * ((1 + 2 * x) * a + x * left) + x * x * ((1 + 2 * y) * b - y * right);
      slope[c] = (6 * x * y * (b - a) + y * (1 - 3 * x) * left + x * (1 - 3 * y) * right) / length;
    }
  }
  return {value[0], value[1], value[2], -slope[0], -slope[1], -slope[2]};
}
} // namespace mpm::model
