#include "io/xdmf.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>

namespace mpm::io
{
namespace
{
const char* attribute_type(int width)
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

void add_data_item(std::string& text, const XdmfData& data)
{
  text += data.integer ? "<DataItem Format=\"HDF\" NumberType=\"Int\" Precision=\""
                       : "<DataItem Format=\"HDF\" NumberType=\"Float\" Precision=\"";
  text += std::to_string(data.bytes);
  text += "\" Dimensions=\"";
  text += std::to_string(data.rows);
  if (data.width > 1)
  {
    text += ' ';
    text += std::to_string(data.width);
  }
  text += "\">";
  text += data.dataset;
  text += "</DataItem>";
}

const std::string document_head = "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n<Domain>\n";
const std::string document_end = "</Domain>\n</Xdmf>\n";
const std::string series_end = "</Grid>\n" + document_end;
/// The end of a series with reserved space behind it; and the end of that space.
const std::string open_end = series_end + "<?room ", space_end = "?>\n";
const std::string blank(open_end.size(), ' ');

constexpr std::size_t least_space = 1 << 16;

/// Spaces to put where the file is this long, so that an end written behind them lies in one page: the system writes
/// that at once, even if the run is killed meanwhile.
std::size_t spaces_before_end(std::size_t length)
{
  constexpr std::size_t page = 4096;
  const std::size_t used = length % page;
  return used + open_end.size() > page ? page - used : 0;
}

/// Writes a text so that readers see the old file or the new one, whole, whenever they look or the run is killed.
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
} // namespace

void add_topology(std::string& text, const char* type, const XdmfData& cells)
{
  text += "<Topology TopologyType=\"";
  text += type;
  text += "\" NumberOfElements=\"";
  text += std::to_string(cells.rows);
  text += "\" NodesPerElement=\"";
  text += std::to_string(cells.width);
  text += "\">";
  add_data_item(text, cells);
  text += "</Topology>\n";
}

void add_geometry(std::string& text, const XdmfData& points)
{
  text += "<Geometry GeometryType=\"XYZ\">";
  add_data_item(text, points);
  text += "</Geometry>\n";
}

void add_attribute(std::string& text, const std::string& name, const char* center, const XdmfData& data)
{
  text += "<Attribute Name=\"";
  text += name;
  text += "\" AttributeType=\"";
  text += attribute_type(data.width);
  text += "\" Center=\"";
  text += center;
  text += "\">";
  add_data_item(text, data);
  text += "</Attribute>\n";
}

std::string begin_of_frame(double time)
{
  std::array<char, 32> digits{}; // as many as it takes to read the same number again
  const char* end = std::to_chars(digits.data(), digits.data() + digits.size(), time).ptr;
  return "<Grid Name=\"frame\" GridType=\"Uniform\">\n<Time Value=\"" +
         std::string(digits.data(), static_cast<std::size_t>(end - digits.data())) + "\"/>\n";
}

std::string XdmfSeries::write_single(const std::string& content)
{
  return replaced_file(_path,
                       document_head + "<Grid Name=\"" + _name + "\" GridType=\"Uniform\">\n" + content + series_end);
}

std::string XdmfSeries::append(const std::string& frame)
{
  const std::size_t from = _end + open_end.size(), spaces = spaces_before_end(from + frame.size());
  if (from + frame.size() + spaces + open_end.size() > _space_end)
    return rewrite(frame, true);
  _addition.assign(frame).append(spaces, ' ').append(open_end);
  errno = 0;
  if (!_file->put(_addition.data(), _addition.size(), static_cast<std::int64_t>(from)) ||
      !_file->put(blank.data(), blank.size(), static_cast<std::int64_t>(_end)))
    return "cannot write " + _path.string() + ": " + std::strerror(errno);
  _end = from + frame.size() + spaces;
  return {};
}

std::string XdmfSeries::finish() { return _file ? rewrite({}, false) : ""; }

std::string XdmfSeries::rewrite(const std::string& frame, bool with_space)
{
  std::string text =
      document_head + "<Grid Name=\"" + _name + "\" GridType=\"Collection\" CollectionType=\"Temporal\">\n";
  const std::size_t frames = text.size();
  if (_file)
  {
    std::string before(_end - _frames, '\0');
    if (!_file->get(before.data(), before.size(), static_cast<std::int64_t>(_frames)))
      return "cannot read " + _path.string() + ": " + std::strerror(errno);
    text += before;
  }
  text += frame;
  if (!with_space)
    return replaced_file(_path, text + series_end);
  text.append(spaces_before_end(text.size()), ' ');
  const std::size_t end = text.size();
  text += open_end;
  text.append(std::max(least_space, end), ' ');
  std::string failure = replaced_file(_path, text + space_end);
  if (!failure.empty())
    return failure;
  _frames = frames;
  _end = end;
  _space_end = text.size();
  _file.emplace(_path.c_str(), O_RDWR);
  return {};
}
} // namespace mpm::io
