#include "materials/tools/parameter.h"

namespace mpm::materials
{
void refuse(std::string_view name, double value, std::string_view range)
{
  throw InputError(std::string(name) + " = " + number_text(value) + ", but it must be " + std::string(range));
}
} // namespace mpm::materials
