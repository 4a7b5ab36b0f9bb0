#include "contact/history.h"

#include <algorithm>
#include <cmath>

namespace mpm::contact
{
template <int N>
Vector<N> mean(const History<N>& history, double from, double to)
{
  Vector<N> sum{};
  const auto add = [&sum](double duration, const Vector<N>& a, const Vector<N>& b)
  {
    for (int i = 0; i < N; ++i)
      sum[i] += 0.5 * duration * (a[i] + b[i]);
  };
  const auto& t = history.times;
  const auto& v = history.values;
  add(std::max(0.0, std::min(to, t.front()) - from), v.front(), v.front());
  for (std::size_t k = 0; k + 1 < t.size(); ++k)
  {
    const double begin = std::clamp(from, t[k], t[k + 1]), end = std::clamp(to, t[k], t[k + 1]);
    const auto at = [&](double time)
    {
      Vector<N> w;
      for (int i = 0; i < N; ++i)
        w[i] = std::lerp(v[k][i], v[k + 1][i], (time - t[k]) / (t[k + 1] - t[k]));
      return w;
    };
    add(end - begin, at(begin), at(end));
  }
  add(std::max(0.0, to - std::max(from, t.back())), v.back(), v.back());
  for (double& component : sum)
    component /= to - from;
  return sum;
}

template <int N>
Vector<N> value_at(const History<N>& history, double time)
{
  const auto& t = history.times;
  const auto next = static_cast<std::size_t>(std::ranges::upper_bound(t, time) - t.begin());
  if (next == 0 || next == t.size())
    return history.values[next == 0 ? 0 : next - 1];
  Vector<N> w;
  for (std::size_t i = 0; i < N; ++i)
    w[i] =
        std::lerp(history.values[next - 1][i], history.values[next][i], (time - t[next - 1]) / (t[next] - t[next - 1]));
  return w;
}

template Vector<2> value_at<2>(const History<2>&, double);
template Vector<3> value_at<3>(const History<3>&, double);
template Vector<2> mean<2>(const History<2>&, double, double);
template Vector<3> mean<3>(const History<3>&, double, double);
} // namespace mpm::contact
