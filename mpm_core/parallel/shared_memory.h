#pragma once
/// @file
/// Memory that all ranks of a machine use together.

#include <mpi.h>

#include <cstddef>
#include <vector>

namespace mpm::parallel
{
/// Memory that all ranks use together, where they are on one machine.
///
/// Every function but `data` is collective.
class SharedMemory
{
public:
  /// @param comm  must outlive the object
  explicit SharedMemory(MPI_Comm comm);
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  /// Provides so many bytes; the contents are lost if the memory has to grow.
  /// @return false, on all ranks, if the ranks are on several machines, or the machine refuses
  bool resize(std::size_t bytes);

  std::byte* data() const { return _data; }

  /// Waits until all ranks have come here; then each sees what the others wrote before.
  void synchronise() const;

  /// Gives the memory back. It is not given back without this, since that is collective.
  void free();

private:
  MPI_Comm _comm;
  int _size = 1;
  bool _one_machine = true;
  std::size_t _bytes = 0;
  std::byte* _data = nullptr;
  MPI_Win _window = MPI_WIN_NULL;
  std::vector<std::byte> _alone; ///< where there is only one rank
};
} // namespace mpm::parallel
