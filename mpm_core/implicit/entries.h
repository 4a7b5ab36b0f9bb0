#pragma once
/// @file
/// Entries of the matrices of an implicit step: blocks between nodes.

#include "implicit/system.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace mpm::implicit
{
/// Blocks of a matrix between nodes. Rows may be another rank's.
struct BlockEntries
{
  std::array<int, 2> shape{};                    ///< rows and columns of a block
  std::vector<std::array<GlobalIndex, 2>> nodes; ///< numbers of the nodes of row and column of each block
  std::vector<double> values;                    ///< of the blocks, row by row
  std::vector<Index> targets;                    ///< the block that each contribution is added to, in their order
};

/// Sums contributions to the blocks of a matrix. The first time it makes the blocks; later times, when the same
/// contributions come in the same order, it only looks up where they go. Builds with assertions check that they do.
class BlockSum
{
public:
  /// @param rows     numbers in the system of what this rank's rows belong to: its nodes, or their means
  /// @param columns  the same of the columns
  BlockSum(BlockEntries& entries, std::array<int, 2> shape, std::span<const GlobalIndex> rows,
           std::span<const GlobalIndex> columns)
      : _entries(entries), _rows(rows), _columns(columns), _known(!entries.targets.empty())
  {
    entries.shape = shape;
    std::ranges::fill(entries.values, 0.0);
    if (!_known)
      _first.assign(rows.size(), none);
  }
  ~BlockSum() { assert(_next == _entries.targets.size()); }
  BlockSum(const BlockSum&) = delete;
  BlockSum& operator=(const BlockSum&) = delete;

  /// The block between two nodes to which the next contribution is to be added; valid until the next call.
  double* next(Index row, Index column)
  {
    if (!_known)
      _entries.targets.push_back(find_or_make(row, _columns[column]));
    assert(is_next(_rows[row], _columns[column]));
    return target();
  }

  /// The same for nodes by their numbers, of which this rank may not have either; each contribution has its own block.
  double* next_apart(GlobalIndex row, GlobalIndex column)
  {
    if (!_known)
      _entries.targets.push_back(make(row, column));
    assert(is_next(row, column));
    return target();
  }

private:
  std::size_t size() const { return static_cast<std::size_t>(_entries.shape[0]) * _entries.shape[1]; }

  /// Whether the next contribution is to the block between these two, as it was the first time.
  bool is_next(GlobalIndex row, GlobalIndex column) const
  {
    return _next < _entries.targets.size() &&
           _entries.nodes[static_cast<std::size_t>(_entries.targets[_next])] == std::array{row, column};
  }

  double* target() { return &_entries.values[static_cast<std::size_t>(_entries.targets[_next++]) * size()]; }

  Index make(GlobalIndex row, GlobalIndex column)
  {
    _entries.nodes.push_back({row, column});
    _entries.values.resize(_entries.values.size() + size());
    _following.push_back(none);
    return static_cast<Index>(_entries.nodes.size()) - 1;
  }

  Index find_or_make(Index row, GlobalIndex column)
  {
    for (Index block = _first[row]; block != none; block = _following[block])
      if (_entries.nodes[block][1] == column)
        return block;
    const Index made = make(_rows[row], column);
    _following[made] = std::exchange(_first[row], made);
    return made;
  }

  BlockEntries& _entries;
  std::span<const GlobalIndex> _rows, _columns;
  bool _known;
  std::size_t _next = 0;
  std::vector<Index> _first, _following; ///< the newest block of each row, and of each block the one before it
};

/// Rows and columns of the values of `entries`, in their order; negative where a node is not in the system.
inline std::array<std::vector<GlobalIndex>, 2> places(const BlockEntries& entries)
{
  std::array<std::vector<GlobalIndex>, 2> found;
  const auto [rows, columns] = entries.shape;
  for (auto& place : found)
    place.reserve(entries.values.size());
  for (const auto [row, column] : entries.nodes)
    for (int i = 0; i < rows; ++i)
      for (int j = 0; j < columns; ++j)
      {
        found[0].push_back(rows * row + i);
        found[1].push_back(columns * column + j);
      }
  return found;
}

/// Sums the tangent: D x D blocks between nodes, whose supported directions are projected out; where water flows, with
/// a row and a column for pressures.
template <int D>
class TangentSum
{
public:
  TangentSum(const ImplicitSystem<D>& system, BlockEntries& entries)
      : _system(system), _sum(entries, {system.unknowns, system.unknowns}, system.number, system.number)
  {
  }

  /// Adds P_row block P_column.
  void add(Index row, Index column, const Matrix<D>& block)
  {
    if (_system.support[row] == none && _system.support[column] == none)
      add_unprojected(row, column, block);
    else
      add_unprojected(row, column, product<D>(projector(_system, row), product<D>(block, projector(_system, column))));
  }

  void add_unprojected(Index row, Index column, const Matrix<D>& block)
  {
    double* sum = _sum.next(row, column);
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j)
        sum[place(i, j)] += block[i][j];
  }

  /// Adds P_row block P_column between nodes of the border of a far field, of which other ranks may have either.
  void add_numbered(const BorderNode<D>& row, const BorderNode<D>& column, const Matrix<D>& block)
  {
    const Matrix<D> projected = product<D>(row.projector, product<D>(block, column.projector));
    double* sum = _sum.next_apart(row.number, column.number);
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j)
        sum[place(i, j)] += projected[i][j];
  }

  /// Adds the forces by the pressure of a column, P_row `forces`; the volume of water of a row by the displacement of
  /// a column, `volumes` P_column; and that by its pressure.
  void add_coupled(Index row, Index column, const Vector<D>& forces, const Vector<D>& volumes, double by_pressure)
  {
    const Vector<D> f = product<D>(projector(_system, row), forces);
    const Vector<D> v = product<D>(projector(_system, column), volumes); // P is symmetric
    double* sum = _sum.next(row, column);
    for (int i = 0; i < D; ++i)
    {
      sum[place(i, D)] += f[i];
      sum[place(D, i)] += v[i];
    }
    sum[place(D, D)] += by_pressure;
  }

  /// Adds the volume of water of a row by the pressure of a column.
  void add_pressure(Index row, Index column, double value) { _sum.next(row, column)[place(D, D)] += value; }

private:
  int place(int i, int j) const { return _system.unknowns * i + j; }

  const ImplicitSystem<D>& _system;
  BlockSum _sum;
};
} // namespace mpm::implicit
