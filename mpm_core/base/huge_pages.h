#pragma once
/// @file
/// Memory for arrays that are streamed through in every step.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace mpm::base
{
/// Allocator that asks for huge pages for arrays larger than one. A step reads and writes some twenty arrays side by
/// side; in pages of 4 KB each of them meets a new page every 512 numbers, whose address the processor has to look up
/// in tables (twice over in a virtual machine), and at which its prefetching stops. Whole steps gain a tenth from
/// 640,000 particles on. Where the system has no huge pages left, it gives others.
template <class T>
struct HugePages
{
  using value_type = T;
  static constexpr std::size_t page = std::size_t{2} << 20;

  HugePages() = default;
  template <class U>
  HugePages(const HugePages<U>&)
  {
  }

  T* allocate(std::size_t n)
  {
    const std::size_t bytes = n * sizeof(T);
    if (bytes < page)
      return std::allocator<T>().allocate(n);
#ifdef __linux__
    // Not from the heap, which keeps what is freed: sorting takes such arrays for a moment.
    void* const wide = mmap(nullptr, mapped(bytes) + page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (wide == MAP_FAILED)
      throw std::bad_alloc();
    const auto begin = reinterpret_cast<std::uintptr_t>(wide);
    const std::uintptr_t first = (begin + page - 1) / page * page;
    char* const memory = static_cast<char*>(wide) + (first - begin);
    if (first > begin)
      munmap(wide, first - begin);
    if (first < begin + page)
      munmap(memory + mapped(bytes), begin + page - first);
    madvise(memory, bytes / page * page, MADV_HUGEPAGE); // what is left of the last page stays small
    return reinterpret_cast<T*>(memory);
#else
    return std::allocator<T>().allocate(n);
#endif
  }

  void deallocate(T* memory, std::size_t n)
  {
#ifdef __linux__
    if (n * sizeof(T) >= page)
    {
      munmap(memory, mapped(n * sizeof(T)));
      return;
    }
#endif
    std::allocator<T>().deallocate(memory, n);
  }

  /// Bytes of address space; those behind the array are never used.
  static std::size_t mapped(std::size_t bytes) { return (bytes + page - 1) / page * page; }

  friend bool operator==(const HugePages&, const HugePages&) = default;
};
} // namespace mpm::base
