#include "io/stamp.h"

#include "io/descriptor.h"
#include "parallel/agreement.h"

#include <unistd.h>

#include <cerrno>
#include <cinttypes>
#include <cstdio>
#include <cstring>

namespace mpm::io
{
namespace
{
struct Sum
{
  std::uint64_t checksum = 0;
  std::string failure;
};

/// Sum over this rank's part of the words behind the stamp of the scrambled word and place.
Sum summed_part(MPI_Comm comm, const std::filesystem::path& path, std::int64_t length)
{
  int rank = 0, size = 1;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &size);
  const std::int64_t words = (length - stamp_size + 7) / 8;
  const std::int64_t first = words * rank / size, last = words * (rank + 1) / size;
  const Descriptor file(path.c_str(), O_RDONLY);
  if (file.number() < 0)
    return {0, std::strerror(errno)};
  Sum sum;
  std::vector<std::uint64_t> buffer(1 << 17);
  for (std::int64_t word = first; word < last;)
  {
    const auto count = std::min<std::int64_t>(static_cast<std::int64_t>(buffer.size()), last - word);
    const std::int64_t from = stamp_size + 8 * word, bytes = std::min(8 * count, length - from);
    buffer[static_cast<std::size_t>(count) - 1] = 0;
    if (!file.get(buffer.data(), static_cast<std::size_t>(bytes), from))
      return {0, errno != 0 ? std::strerror(errno) : "it is truncated"};
    for (std::int64_t k = 0; k < count; ++k, ++word)
      sum.checksum += mixed(buffer[static_cast<std::size_t>(k)] ^ mixed(static_cast<std::uint64_t>(word)));
  }
  return sum;
}

void raise_together(MPI_Comm comm, const char* doing, const std::filesystem::path& path, const std::string& failure)
{
  const std::string text =
      failure.empty() ? "" : std::string("cannot ") + doing + " checkpoint " + path.string() + ": " + failure;
  if (const std::string shared = shared_failure(comm, text); !shared.empty())
    throw RunError(shared);
}

/// Checksum of a file of this length over all ranks.
std::uint64_t checksum(MPI_Comm comm, const char* doing, const std::filesystem::path& path, std::int64_t length)
{
  Sum sum = summed_part(comm, path, length);
  raise_together(comm, doing, path, sum.failure);
  MPI_Allreduce(MPI_IN_PLACE, &sum.checksum, 1, MPI_UINT64_T, MPI_SUM, comm);
  return sum.checksum;
}

/// What the stamp says; equal on all ranks.
struct Stamp
{
  int format = 0;
  std::int64_t bytes = 0;
  std::uint64_t checksum = 0;
};
constexpr char stamp_text[] = "talus checkpoint\nformat %d\nbytes %" PRId64 "\nchecksum %016" PRIx64 "\n";
constexpr char stamp_pattern[] = "talus checkpoint\nformat %d\nbytes %" SCNd64 "\nchecksum %" SCNx64 "\n";

std::string read_stamp(const std::filesystem::path& path, Stamp& stamp)
{
  const Descriptor file(path.c_str(), O_RDONLY);
  if (file.number() < 0)
    return std::strerror(errno);
  char text[stamp_size + 1] = {};
  const auto length = ::pread(file.number(), text, stamp_size, 0);
  if (length < 0)
    return std::strerror(errno);
  const int found = std::sscanf(text, stamp_pattern, &stamp.format, &stamp.bytes, &stamp.checksum);
  if (found < 1)
    return "it is not a checkpoint, or its first bytes are damaged";
  if (stamp.format != checkpoint_format)
    return "it has format " + std::to_string(stamp.format) + ", this program reads format " +
           std::to_string(checkpoint_format);
  if (found < 3)
    return "its first bytes are damaged";
  const std::int64_t size = ::lseek(file.number(), 0, SEEK_END);
  if (size != stamp.bytes)
    return "it has " + std::to_string(size) + " bytes, expected " + std::to_string(stamp.bytes) +
           "; it is truncated or damaged";
  return {};
}
} // namespace

void stamp_file(MPI_Comm comm, const std::filesystem::path& path)
{
  std::error_code error;
  const auto length = static_cast<std::int64_t>(std::filesystem::file_size(path, error));
  raise_together(comm, "write", path, error ? error.message() : "");
  const std::uint64_t sum = checksum(comm, "write", path, length);
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  std::string failure;
  {
    // Every rank flushes what it wrote: on a parallel file system its data may wait on its own node.
    const Descriptor file(path.c_str(), O_RDWR);
    char text[stamp_size] = {};
    std::snprintf(text, sizeof(text), stamp_text, checkpoint_format, length, sum);
    if (file.number() < 0 || (rank == 0 && ::pwrite(file.number(), text, sizeof(text), 0) != stamp_size) ||
        ::fsync(file.number()) != 0)
      failure = std::strerror(errno);
  }
  raise_together(comm, "write", path, failure);
}

void check_stamp(MPI_Comm comm, const std::filesystem::path& path)
{
  Stamp stamp;
  raise_together(comm, "read", path, read_stamp(path, stamp));
  const bool same = checksum(comm, "read", path, stamp.bytes) == stamp.checksum;
  raise_together(comm, "read", path, same ? "" : "its checksum is not that of its content; it is damaged");
}
} // namespace mpm::io
