#include "contact/motion.h"

#include <algorithm>
#include <cmath>

namespace mpm::contact
{
template <int D>
Vector<D> displacement(const Motion<D>& motion, double from, double to)
{
  Vector<D> moved{};
  const auto add = [&moved](double duration, const Vector<D>& a, const Vector<D>& b)
  {
    for (int i = 0; i < D; ++i)
      moved[i] += 0.5 * duration * (a[i] + b[i]);
  };
  const auto& t = motion.times;
  const auto& v = motion.velocities;
  add(std::max(0.0, std::min(to, t.front()) - from), v.front(), v.front());
  for (std::size_t k = 0; k + 1 < t.size(); ++k)
  {
    const double begin = std::clamp(from, t[k], t[k + 1]), end = std::clamp(to, t[k], t[k + 1]);
    const auto at = [&](double time)
    {
      Vector<D> w;
      for (int i = 0; i < D; ++i)
        w[i] = std::lerp(v[k][i], v[k + 1][i], (time - t[k]) / (t[k + 1] - t[k]));
      return w;
    };
    add(end - begin, at(begin), at(end));
  }
  add(std::max(0.0, to - std::max(from, t.back())), v.back(), v.back());
  return moved;
}

template Vector<2> displacement<2>(const Motion<2>&, double, double);
template Vector<3> displacement<3>(const Motion<3>&, double, double);
} // namespace mpm::contact
