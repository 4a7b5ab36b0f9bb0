#pragma once
/// @file
/// What the sources share that read and write files by the system's calls.

#include <fcntl.h>
#include <unistd.h>

#include <filesystem>

namespace mpm
{
/// A file that closes itself.
class Descriptor
{
public:
  Descriptor(const std::filesystem::path& path, int flags) : _file(::open(path.c_str(), flags | O_CLOEXEC)) {}
  ~Descriptor()
  {
    if (_file >= 0)
      ::close(_file);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return _file; }

private:
  int _file;
};

} // namespace mpm
