#include "io/xdmf.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iomanip>
#include <sstream>

namespace mpm
{
namespace
{
std::string attribute_type(int width)
{
  switch (width)
  {
  case 1:
    return "Scalar";
  case 3:
    return "Vector";
  case 9:
    return "Tensor";
  default:
    return "Matrix";
  }
}

std::string document(const std::string& grid)
{
  return "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n<Domain>\n" + grid + "</Domain>\n</Xdmf>\n";
}
} // namespace

std::string xdmf_data_item(const XdmfData& data)
{
  std::ostringstream text;
  text << "<DataItem Format=\"HDF\" NumberType=\"" << (data.integer ? "Int" : "Float") << "\" Precision=\""
       << data.bytes << "\" Dimensions=\"" << data.rows;
  if (data.width > 1)
    text << ' ' << data.width;
  text << "\">" << data.dataset << "</DataItem>";
  return text.str();
}

std::string xdmf_topology(const std::string& type, const XdmfData& cells)
{
  std::ostringstream text;
  text << "<Topology TopologyType=\"" << type << "\" NumberOfElements=\"" << cells.rows << "\" NodesPerElement=\""
       << cells.width << "\">" << xdmf_data_item(cells) << "</Topology>\n";
  return text.str();
}

std::string xdmf_geometry(const XdmfData& points)
{
  return "<Geometry GeometryType=\"XYZ\">" + xdmf_data_item(points) + "</Geometry>\n";
}

std::string xdmf_attribute(const std::string& name, const std::string& center, const XdmfData& data)
{
  return "<Attribute Name=\"" + name + "\" AttributeType=\"" + attribute_type(data.width) + "\" Center=\"" + center +
         "\">" + xdmf_data_item(data) + "</Attribute>\n";
}

std::string xdmf_frame(double time, const std::string& content)
{
  std::ostringstream text;
  text << "<Grid Name=\"frame\" GridType=\"Uniform\">\n<Time Value=\"" << std::setprecision(17) << time << "\"/>\n"
       << content << "</Grid>\n";
  return text.str();
}

std::string xdmf_series(const std::string& name, const std::string& frames)
{
  return document("<Grid Name=\"" + name + "\" GridType=\"Collection\" CollectionType=\"Temporal\">\n" + frames +
                  "</Grid>\n");
}

std::string xdmf_single(const std::string& name, const std::string& content)
{
  return document("<Grid Name=\"" + name + "\" GridType=\"Uniform\">\n" + content + "</Grid>\n");
}

std::string replaced_file(const std::filesystem::path& path, const std::string& text)
{
  std::filesystem::path aside = path;
  aside += ".part";
  errno = 0;
  std::ofstream file(aside, std::ios::binary | std::ios::trunc);
  file << text;
  file.close();
  if (!file)
    return "cannot write " + aside.string() + ": " + std::strerror(errno);
  std::error_code error;
  std::filesystem::rename(aside, path, error);
  return error ? "cannot write " + path.string() + ": " + error.message() : "";
}
} // namespace mpm
