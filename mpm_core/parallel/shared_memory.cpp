#include "parallel/shared_memory.h"

#include <bit>

namespace mpm::parallel
{
SharedMemory::SharedMemory(MPI_Comm comm) : _comm(comm)
{
  MPI_Comm_size(_comm, &_size);
  MPI_Comm machine = MPI_COMM_NULL;
  MPI_Comm_split_type(_comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine);
  int together = 0;
  MPI_Comm_size(machine, &together);
  MPI_Comm_free(&machine);
  _one_machine = together == _size; // on all ranks or on none
}

bool SharedMemory::resize(std::size_t bytes)
{
  if (!_one_machine)
    return false;
  if (bytes <= _bytes)
    return true;
  free();
  bytes = std::bit_ceil(bytes); // so that what grows slowly is not moved each time
  if (_size == 1)
  {
    _alone.resize(bytes);
    _data = _alone.data();
    _bytes = bytes;
    return true;
  }
  int rank = 0;
  MPI_Comm_rank(_comm, &rank);
  const auto own = static_cast<MPI_Aint>(rank == 0 ? bytes : 0);
  void* first = nullptr;
  int good = MPI_Win_allocate_shared(own, 1, MPI_INFO_NULL, _comm, &first, &_window) == MPI_SUCCESS;
  MPI_Allreduce(MPI_IN_PLACE, &good, 1, MPI_INT, MPI_MIN, _comm);
  if (!good)
    return _one_machine = false; // not to be tried again
  MPI_Aint length = 0;
  int unit = 1;
  MPI_Win_shared_query(_window, 0, &length, &unit, &first);
  MPI_Win_lock_all(MPI_MODE_NOCHECK, _window);
  _data = static_cast<std::byte*>(first);
  _bytes = bytes;
  return true;
}

void SharedMemory::synchronise() const
{
  if (_size == 1)
    return;
  MPI_Win_sync(_window);
  MPI_Barrier(_comm);
  MPI_Win_sync(_window);
}

void SharedMemory::free()
{
  if (_window != MPI_WIN_NULL)
  {
    MPI_Win_unlock_all(_window);
    MPI_Win_free(&_window);
  }
  _alone.clear();
  _data = nullptr;
  _bytes = 0;
}
} // namespace mpm::parallel
