#pragma once
/// @file
/// What the sources share that read and write files by the system's calls.

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>

namespace mpm::io
{
/// A file that closes itself.
class Descriptor
{
public:
  /// @param flags  as of `open`; a file that is made may be read and written by all whom the umask lets
  Descriptor(const char* path, int flags) : _file(::open(path, flags | O_CLOEXEC, 0666)) {}
  ~Descriptor()
  {
    if (_file >= 0)
      ::close(_file);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return _file; }

  /// Reads a part of the file.
  /// @return whether all was there; if not, errno says why, or is 0 if the file ends before
  bool get(void* bytes, std::size_t count, std::int64_t at) const
  {
    for (std::size_t done = 0; done < count;)
    {
      errno = 0;
      const auto got = ::pread(_file, static_cast<char*>(bytes) + done, count - done,
                               static_cast<off_t>(at) + static_cast<off_t>(done));
      if (got <= 0)
        return false;
      done += static_cast<std::size_t>(got);
    }
    return true;
  }

  /// Writes into a part of the file.
  /// @return whether all was written; if not, errno says why
  bool put(const void* bytes, std::size_t count, std::int64_t at) const
  {
    for (std::size_t done = 0; done < count;)
    {
      const auto wrote = ::pwrite(_file, static_cast<const char*>(bytes) + done, count - done,
                                  static_cast<off_t>(at) + static_cast<off_t>(done));
      if (wrote <= 0)
        return false;
      done += static_cast<std::size_t>(wrote);
    }
    return true;
  }

private:
  int _file;
};

} // namespace mpm::io
