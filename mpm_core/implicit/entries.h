#pragma once
/// @file
/// Entries of the matrices of an implicit step, in coordinate (COO) form.

#include "implicit/system.h"

#include <algorithm>

namespace mpm::implicit
{
/// Entries that are added up where rows and columns repeat. Rows may be another rank's.
struct CooEntries
{
  std::vector<GlobalIndex> rows, columns;
  std::vector<double> values;
};

/// Writes the entries of a matrix anew, in order; rows and columns only the first time.
class Writer
{
public:
  explicit Writer(CooEntries& entries) : _entries(entries), _places(entries.rows.empty()) {}
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// Takes memory for more entries; must come before they are added.
  void expect(std::size_t more)
  {
    const std::size_t size = _next + more;
    grow(_entries.values, size);
    if (!_places)
      return;
    grow(_entries.rows, size);
    grow(_entries.columns, size);
  }

  void add(GlobalIndex row, GlobalIndex column, double value)
  {
    _entries.values[_next] = value;
    if (_places)
    {
      _entries.rows[_next] = row;
      _entries.columns[_next] = column;
    }
    ++_next;
  }

private:
  template <class T>
  static void grow(std::vector<T>& column, std::size_t size)
  {
    if (size > column.capacity())
      column.reserve(size + size / 4); // cells come first and are most: what follows needs no other copy
    column.resize(std::max(size, column.size()));
  }

  CooEntries& _entries;
  bool _places;
  std::size_t _next = 0;
};

/// Writes the tangent as D x D blocks between nodes: numbers the nodes, and projects supported directions out.
template <int D>
class BlockWriter
{
public:
  BlockWriter(const ImplicitSystem<D>& system, CooEntries& entries) : _system(system), _writer(entries) {}

  /// Takes memory for more blocks; must come before they are added.
  void expect(std::size_t more) { _writer.expect(more * D * D); }

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
    const GlobalIndex first_row = place(row, 0), first_column = place(column, 0);
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j)
        _writer.add(first_row + i, first_column + j, block[i][j]);
  }

  /// Takes memory for more blocks with pressures; must come before they are added.
  void expect_coupled(std::size_t more) { _writer.expect(more * (2 * D + 1)); }

  /// Adds the forces by the pressure of a column, P_row `forces`; the volume of water of a row by the displacement of
  /// a column, `volumes` P_column; and that by its pressure.
  void add_coupled(Index row, Index column, const Vector<D>& forces, const Vector<D>& volumes, double by_pressure)
  {
    const Vector<D> f = product<D>(projector(_system, row), forces);
    const Vector<D> v = product<D>(projector(_system, column), volumes); // P is symmetric
    for (int i = 0; i < D; ++i)
    {
      _writer.add(place(row, i), place(column, D), f[i]);
      _writer.add(place(row, D), place(column, i), v[i]);
    }
    _writer.add(place(row, D), place(column, D), by_pressure);
  }

  /// Takes memory for more entries of pressures alone; must come before they are added.
  void expect_pressures(std::size_t more) { _writer.expect(more); }

  /// Adds the volume of water of a row by the pressure of a column.
  void add_pressure(Index row, Index column, double value) { _writer.add(place(row, D), place(column, D), value); }

private:
  GlobalIndex place(Index node, int component) const { return _system.unknowns * _system.number[node] + component; }

  const ImplicitSystem<D>& _system;
  Writer _writer;
};
} // namespace mpm::implicit
