#include "parallel/row_slice.h"

namespace mpm::parallel
{
RowSlice row_slice(MPI_Comm comm, std::size_t local)
{
  RowSlice rows;
  rows.local = static_cast<GlobalIndex>(local);
  GlobalIndex up_to_here = 0;
  MPI_Scan(&rows.local, &up_to_here, 1, MPI_INT64_T, MPI_SUM, comm);
  rows.before = up_to_here - rows.local;
  MPI_Allreduce(&rows.local, &rows.total, 1, MPI_INT64_T, MPI_SUM, comm);
  return rows;
}
} // namespace mpm::parallel
