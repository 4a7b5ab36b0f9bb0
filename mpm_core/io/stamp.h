#pragma once
/// @file
/// The stamp of a checkpoint: a few lines of text in the first 512 bytes of its file, which HDF5 leaves to the user.
/// They name the format and hold length and checksum of the rest, so that a damaged file is known before anything reads
/// it.

#include "base/types.h"

#include <mpi.h>

#include <filesystem>

namespace mpm::io
{
inline constexpr int stamp_size = 512;
inline constexpr int checkpoint_format = 1;

/// Scrambles a word so that each of its bits changes about half of the result's (splitmix64; Steele, Lea & Flood 2014).
inline std::uint64_t mixed(std::uint64_t z)
{
  z += 0x9E3779B97F4A7C15U;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
  return z ^ (z >> 31);
}

/// Writes the stamp of a file that is whole but for it, and sees to it that the file is on the disk.
/// @throws RunError on all ranks, with path and reason
/// @note Collective
void stamp_file(MPI_Comm comm, const std::filesystem::path& path);

/// @throws RunError on all ranks: the file cannot be read, is no checkpoint, has a format that is not known here, is
/// truncated or damaged
/// @note Collective
void check_stamp(MPI_Comm comm, const std::filesystem::path& path);
} // namespace mpm::io
