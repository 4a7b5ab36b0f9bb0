#include "python/bindings.h"

#include "io/series.h"
#include "python/arrays.h"

#include <memory>

namespace mpm::python
{
namespace
{
using RealArray = py::array_t<double, py::array::c_style>;
using IntegerArray = py::array_t<std::int64_t, py::array::c_style>;
using RealFields = std::vector<std::pair<std::string, RealArray>>;
using IntegerFields = std::vector<std::pair<std::string, IntegerArray>>;

Storage storage(bool float32, int compression)
{
  return {float32 ? Precision::float32 : Precision::float64, compression};
}

/// Components per row: 1 for shape (n,), k for (n, k).
int width(const py::array& array) { return array.ndim() < 2 ? 1 : static_cast<int>(array.shape(1)); }

std::vector<OutputField> output_fields(const RealFields& fields)
{
  std::vector<OutputField> output;
  for (const auto& [name, array] : fields)
    output.push_back({name, width(array), values<double>(array)});
  return output;
}

std::vector<OutputIndexField> output_fields(const IntegerFields& fields)
{
  std::vector<OutputIndexField> output;
  for (const auto& [name, array] : fields)
    output.push_back({name, values<std::int64_t>(array)});
  return output;
}
} // namespace

void bind_io(py::module_& m)
{
  py::class_<ParticleSeries>(m, "ParticleSeries")
      .def(py::init(
               [](std::uintptr_t comm, const std::string& path, bool float32, int compression)
               { return std::make_unique<ParticleSeries>(communicator(comm), path, storage(float32, compression)); }),
           py::arg("comm"), py::arg("path"), py::arg("float32"), py::arg("compression"))
      .def(
          "write",
          [](ParticleSeries& series, double time, const RealArray& position, const RealFields& fields,
             const IntegerFields& index_fields) {
            series.write(time, width(position), values<double>(position), output_fields(fields),
                         output_fields(index_fields));
          },
          py::arg("time"), py::arg("position"), py::arg("fields"), py::arg("index_fields"))
      .def("close", &ParticleSeries::close);

  py::class_<MeshSeries>(m, "MeshSeries")
      .def(py::init(
               [](std::uintptr_t comm, const std::string& path, bool float32, int compression, const RealArray& points,
                  const IntegerArray& cells)
               {
                 return std::make_unique<MeshSeries>(communicator(comm), path, storage(float32, compression),
                                                     width(points), values<double>(points),
                                                     values<std::int64_t>(cells));
               }),
           py::arg("comm"), py::arg("path"), py::arg("float32"), py::arg("compression"), py::arg("points"),
           py::arg("cells"))
      .def(
          "write",
          [](MeshSeries& series, double time, const RealFields& node_fields, const RealFields& cell_fields)
          { series.write(time, output_fields(node_fields), output_fields(cell_fields)); },
          py::arg("time"), py::arg("node_fields"), py::arg("cell_fields"))
      .def("close", &MeshSeries::close);
}
} // namespace mpm::python
