#include "python/bindings.h"

#include "io/particle_fields.h"
#include "parallel/agreement.h"
#include "python/arrays.h"
#include "steps/run.h"

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
    output.push_back(row_field(name, values<double>(array), width(array)));
  return output;
}

std::vector<OutputIndexField> output_fields(const IntegerFields& fields)
{
  std::vector<OutputIndexField> output;
  for (const auto& [name, array] : fields)
    output.push_back({name, values<std::int64_t>(array)});
  return output;
}

/// Writes fields of a model's particles from where they are, and further ones.
template <int D>
void write_model(ParticleSeries& series, double time, const Model<D>& model, const std::vector<std::string>& names,
                 const RealFields& more, const IntegerFields& more_integers)
{
  ParticleFields all;
  collectively(series.comm(), [&] { all = particle_fields<D>(model.particles, names); });
  for (OutputField& field : output_fields(more))
    all.fields.push_back(std::move(field));
  for (OutputIndexField& field : output_fields(more_integers))
    all.index_fields.push_back(std::move(field));
  series.write(time, all.position, all.fields, all.index_fields);
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
             const IntegerFields& index_fields)
          {
            series.write(time, row_field("position", values<double>(position), width(position)), output_fields(fields),
                         output_fields(index_fields));
          },
          py::arg("time"), py::arg("position"), py::arg("fields"), py::arg("index_fields"))
      .def("write_model", &write_model<2>)
      .def("write_model", &write_model<3>)
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
