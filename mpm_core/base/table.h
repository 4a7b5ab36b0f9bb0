#pragma once
/// @file
/// Tables of numbers by name, in which run state goes to files and back.

#include "base/types.h"

namespace mpm::base
{
/// Rows of `width` numbers; row-major.
struct Table
{
  std::string name;
  int width = 1;
  std::vector<double> values;
  double most_count = 0;       ///< where above 0, the numbers are counts: whole numbers from 0 to this one
  bool is_positive = false;    ///< no number is below 0, such as a length of time
  bool may_be_unknown = false; ///< a number may be NaN, such as an energy that a law does not say
};
} // namespace mpm::base
