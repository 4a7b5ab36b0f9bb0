#pragma once
/// @file
/// The XDMF text beside an HDF5 file, which tells ParaView, VTK and meshio what its datasets are.

#include "base/types.h"

#include <filesystem>
#include <string>

namespace mpm
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

std::string xdmf_data_item(const XdmfData& data);

/// @param type   "Polyvertex", "Triangle" or "Tetrahedron"
/// @param cells  node numbers, one row per cell
std::string xdmf_topology(const std::string& type, const XdmfData& cells);

/// @param points  (n, 3)
std::string xdmf_geometry(const XdmfData& points);

/// @param center  "Node" or "Cell"
std::string xdmf_attribute(const std::string& name, const std::string& center, const XdmfData& data);

/// One frame of a series.
std::string xdmf_frame(double time, const std::string& content);

/// A whole file: frames as a collection over time.
std::string xdmf_series(const std::string& name, const std::string& frames);

/// A whole file: one grid without time.
std::string xdmf_single(const std::string& name, const std::string& content);

/// Writes a text so that readers see the old file or the new one, whole, whenever they look or the run is killed.
/// @return what went wrong, with path and reason; empty if nothing did
std::string replaced_file(const std::filesystem::path& path, const std::string& text);
} // namespace mpm
