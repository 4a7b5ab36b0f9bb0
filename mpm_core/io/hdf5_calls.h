#pragma once
/// @file
/// What the sources that call HDF5 share. Included by them only.

#include "io/hdf5_file.h"

#include <hdf5.h>

#include <cstdint>
#include <string>
#include <type_traits>

namespace mpm::io
{
static_assert(std::is_same_v<hid_t, std::int64_t>);

/// Keeps HDF5 from printing its error stack while it lives; the reason goes into the exception instead.
class Quiet
{
public:
  Quiet()
  {
    H5Eget_auto2(H5E_DEFAULT, &_function, &_data);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~Quiet() { H5Eset_auto2(H5E_DEFAULT, _function, _data); }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

private:
  H5E_auto2_t _function = nullptr;
  void* _data = nullptr;
};

inline hid_t hdf5_type(Number number)
{
  switch (number)
  {
  case Number::float32:
    return H5T_NATIVE_FLOAT;
  case Number::float64:
    return H5T_NATIVE_DOUBLE;
  case Number::int32:
    return H5T_NATIVE_INT32;
  default:
    return H5T_NATIVE_INT64;
  }
}

/// The innermost message of HDF5's error stack, which is the nearest to the cause.
inline std::string hdf5_reason()
{
  std::string reason;
  const auto keep_last = [](unsigned, const H5E_error2_t* error, void* text) -> herr_t
  {
    if (error->desc)
      *static_cast<std::string*>(text) = error->desc;
    return 0;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_DOWNWARD, keep_last, &reason);
  return reason;
}
} // namespace mpm::io
