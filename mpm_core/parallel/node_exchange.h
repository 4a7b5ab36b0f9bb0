#pragma once
/// @file
/// Sums over nodes that several ranks share.

#include "mesh/mesh.h"
#include "parallel/messages.h"

#include <algorithm>
#include <type_traits>

namespace mpm::parallel
{
/// Which nodes this rank shares with which others, and the buffers of their messages.
struct NodeExchange
{
  MPI_Comm comm = MPI_COMM_SELF;
  int rank = 0;
  int size = 1;
  std::vector<Link> neighbours;     ///< by rising rank; the shared nodes are both given and taken
  std::vector<Index> shared_nodes;  ///< all nodes that have a neighbour
  std::vector<double> own;          ///< this rank's part of them during a sum
  std::vector<unsigned char> owned; ///< per node: 1 on exactly one of the ranks that share it, for global sums
  bool reproducible = false;        ///< sums at nodes are the same to the last bit on any number of ranks
};

/// Whether a rank is this one or one of its neighbours.
inline bool is_within_reach(const NodeExchange& exchange, int rank)
{
  const auto same = [rank](const Link& neighbour) { return neighbour.rank == rank; };
  return rank == exchange.rank || std::any_of(exchange.neighbours.begin(), exchange.neighbours.end(), same);
}

/// @note Collective. Nodes of ghost cells that no owned cell touches are not exchanged.
template <int D>
NodeExchange make_node_exchange(const Mesh<D>& mesh, MPI_Comm comm);

/// Replaces the values of shared nodes by their sum over the ranks that share them. The sum runs by rising rank, so it
/// is the same to the last bit on all of them. One message per neighbour.
/// @param values  (nodes, width) row-major
/// @note Collective over neighbours
void sum_shared(NodeExchange& exchange, double* values, int width);

/// The same for the largest of the values in the place of their sum.
void max_shared(NodeExchange& exchange, double* values, int width);

/// How many doubles a T consists of.
template <class T>
consteval int doubles_in()
{
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(double) == 0);
  return static_cast<int>(sizeof(T) / sizeof(double));
}

/// The same for a vector or span with so many entries per node, which consist of doubles only; it may be empty.
template <class Values>
void sum_shared(NodeExchange& exchange, Values&& values, int per_node = 1)
{
  using T = typename std::remove_cvref_t<Values>::value_type;
  sum_shared(exchange, reinterpret_cast<double*>(values.data()), per_node * doubles_in<T>());
}

template <class T>
void max_shared(NodeExchange& exchange, std::vector<T>& values, int per_node = 1)
{
  max_shared(exchange, reinterpret_cast<double*>(values.data()), per_node * doubles_in<T>());
}
} // namespace mpm::parallel
