#pragma once
/// @file
/// The XDMF text beside an HDF5 file, which tells ParaView, VTK and meshio what its datasets are.

#include "base/types.h"
#include "io/descriptor.h"

#include <filesystem>
#include <optional>
#include <string>

namespace mpm::io
{
/// How a dataset is described.
struct XdmfData
{
  std::string dataset;   ///< "file.h5:/path"
  GlobalIndex rows = -1; ///< -1: nothing was written
  int width = 1;
  bool integer = false;
  int bytes = 8; ///< per value
};

/// Each of these adds to a text, which is made for every frame.
/// @param type   "Polyvertex", "Triangle" or "Tetrahedron"
/// @param cells  node numbers, one row per cell
void add_topology(std::string& text, const char* type, const XdmfData& cells);

/// @param points  (n, 3)
void add_geometry(std::string& text, const XdmfData& points);

/// @param center  "Node" or "Cell"
void add_attribute(std::string& text, const std::string& name, const char* center, const XdmfData& data);

/// The beginning of a frame of a series.
std::string begin_of_frame(double time);
inline const char* const end_of_frame = "</Grid>\n";

/// The XDMF file of a series. Readers find a whole document in it whenever they look or the run is killed.
///
/// A frame is added without writing those before it once more. The file goes on after the document's end with a
/// processing instruction of many spaces, which readers skip. A frame, and the document's new end, are written among
/// these spaces; then the old end, with the beginning of the instruction, is blotted out. When the space is used up,
/// or at the end, the whole file is written aside and renamed.
///
/// Functions give what went wrong, with path and reason; an empty text if nothing did.
class XdmfSeries
{
public:
  /// @param name  of the grid
  XdmfSeries(std::filesystem::path path, std::string name) : _path(std::move(path)), _name(std::move(name)) {}

  std::string write_without_frames() { return rewrite({}, false); }
  /// Writes one grid without time in place of the series.
  std::string write_single(const std::string& content);
  /// Adds a frame, from `begin_of_frame` to `end_of_frame`; if that fails, all is as before.
  std::string append(const std::string& frame);
  /// Leaves the document without space behind it. Nothing is added after that.
  std::string finish();

private:
  /// @param frame  is added to those that the file has
  std::string rewrite(const std::string& frame, bool with_space);

  std::filesystem::path _path;
  std::string _name;
  std::size_t _frames = 0;         ///< where frames begin in the file
  std::size_t _end = 0;            ///< where the document's end begins
  std::size_t _space_end = 0;      ///< where the spaces end
  std::optional<Descriptor> _file; ///< with space behind the document
  std::string _addition;
};
} // namespace mpm::io
