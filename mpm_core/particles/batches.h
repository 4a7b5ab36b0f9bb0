#pragma once
/// @file
/// Division of the particles into batches, each of which a law is given at once.

#include "particles/particles.h"

namespace mpm::particles
{
/// Longest run of particles, and so the batch that a law is given: its scratch stays in the first-level cache.
inline constexpr Index batch_size = 256;

/// Runs of one material, one behind the other, at most `batch_size` particles: what a law is given at once.
struct Batch
{
  std::size_t first_run, last_run;
  Index first, last;
  Index material;
};

/// The batch that begins with a run.
inline Batch next_batch(const std::vector<Run>& runs, std::size_t first_run)
{
  Batch batch{first_run, first_run + 1, runs[first_run].first, runs[first_run].last, runs[first_run].material};
  while (batch.last_run < runs.size() && runs[batch.last_run].material == batch.material &&
         runs[batch.last_run].first == batch.last && runs[batch.last_run].last - batch.first <= batch_size)
    batch.last = runs[batch.last_run++].last;
  return batch;
}
} // namespace mpm::particles
