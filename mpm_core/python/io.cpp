#include "python/bindings.h"

#include "explicit/run.h"
#include "io/particle_fields.h"
#include "parallel/agreement.h"
#include "parallel/row_carrier.h"
#include "python/arrays.h"
#include "python/nodal_field.h"

#include <algorithm>
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

/// Nodal fields of a model by name.
/// @param carrier  to the nodes of the mesh as it is written; null if the model's has the same partition
template <class G, int D = G::dim>
std::vector<OutputField> nodal_fields(const Model<G>& model, const std::vector<std::string>& names, RowCarrier* carrier)
{
  std::vector<OutputField> fields;
  for (const std::string& name : names)
  {
    OutputField& field = fields.emplace_back(nodal_field(model, name));
    field.carrier = carrier;
    if (carrier)
      field.rows = carrier->n_wanted();
  }
  return fields;
}

/// What a model's frames consist of; the same on all ranks.
struct ModelFields
{
  std::vector<std::string> particles, nodes;
};

/// @throws InputError on all ranks for a field that does not exist, or names that are not the same on all
template <class G, int D = G::dim>
ModelFields model_fields(std::uintptr_t comm, const Model<G>& model, std::vector<std::string> particles,
                         std::vector<std::string> nodes)
{
  ModelFields names{std::move(particles), std::move(nodes)};
  const std::string error = input_error_of(
      [&]
      {
        particle_fields<D>(model.particles, names.particles);
        for (const std::string& name : names.nodes)
          require_nodal_field(model, name);
      });
  std::string text;
  for (const std::string& name : names.particles)
    text += name + ",";
  text += ";";
  for (const std::string& name : names.nodes)
    text += name + ",";
  require_same_fields(communicator(comm), error, text);
  return names;
}

/// Writes fields of a model from where they are.
/// @param particles  null if none are written
/// @param mesh       null if it is not written
/// @param carrier    as `nodal_fields` takes it
/// @param more       further fields of the particles
template <class G, int D = G::dim>
void write_model(std::uintptr_t comm, const Model<G>& model, const ModelFields& names, ParticleSeries* particles,
                 MeshSeries* mesh, RowCarrier* carrier, const RealFields& more, const IntegerFields& more_integers,
                 const std::string& failure)
{
  Frame frame{.time = model.time, .particles = particles, .mesh = mesh, .failure = failure};
  if (mesh)
    frame.mesh_fields.nodes = nodal_fields(model, names.nodes, carrier); // raises errors on all ranks or on none
  if (particles && frame.failure.empty())
    frame.failure =
        input_error_of([&] { frame.particle_fields = particle_fields<D>(model.particles, names.particles); });
  for (OutputField& field : output_fields(more))
    frame.particle_fields.fields.push_back(std::move(field));
  if constexpr (G::has_hoop)
    for (OutputField& field : frame.particle_fields.fields)
      field.out_of_plane = "hoop";
  for (OutputIndexField& field : output_fields(more_integers))
    frame.particle_fields.index_fields.push_back(std::move(field));
  write(communicator(comm), frame);
}
} // namespace

void bind_io(py::module_& m)
{
  py::class_<RowCarrier>(m, "RowCarrier")
      .def(
          py::init([](std::uintptr_t comm, const IntegerArray& ranks, const IntegerArray& rows)
                   { return RowCarrier(communicator(comm), values<std::int64_t>(ranks), values<std::int64_t>(rows)); }))
      .def("carry",
           [](RowCarrier& carrier, const RealArray& array)
           {
             const auto n = static_cast<std::size_t>(width(array));
             const std::span<const double> rows =
                 carrier.carry(n, [&](std::size_t row, double* to) { std::copy_n(array.data() + row * n, n, to); });
             return py::array_t<double>({carrier.n_wanted(), n}, rows.data());
           });

  py::class_<ParticleSeries>(m, "ParticleSeries")
      .def(py::init(
               [](std::uintptr_t comm, const std::string& path, bool float32, int compression)
               { return std::make_unique<ParticleSeries>(communicator(comm), path, storage(float32, compression)); }),
           py::arg("comm"), py::arg("path"), py::arg("float32"), py::arg("compression"))
      .def(
          "write",
          [](ParticleSeries& series, double time, const RealArray& position, const RealFields& fields,
             const IntegerFields& index_fields, const std::string& failure)
          {
            write(series.file().comm(),
                  {.time = time,
                   .particles = &series,
                   .particle_fields = {row_field("position", values<double>(position), width(position)),
                                       output_fields(fields), output_fields(index_fields)},
                   .failure = failure});
          },
          py::arg("time"), py::arg("position"), py::arg("fields"), py::arg("index_fields"), py::arg("failure"))
      .def("close", [](ParticleSeries& series) { series.file().close(); });

  py::class_<MeshSeries>(m, "MeshSeries")
      .def(py::init(
               [](std::uintptr_t comm, const std::string& path, bool float32, int compression, const RealArray& points,
                  const IntegerArray& cells, const RealFields& fixed)
               {
                 return std::make_unique<MeshSeries>(communicator(comm), path, storage(float32, compression),
                                                     width(points), values<double>(points), values<std::int64_t>(cells),
                                                     output_fields(fixed));
               }),
           py::arg("comm"), py::arg("path"), py::arg("float32"), py::arg("compression"), py::arg("points"),
           py::arg("cells"), py::arg("fixed"))
      .def(
          "write",
          [](MeshSeries& series, double time, const RealFields& node_fields, const RealFields& cell_fields,
             const std::string& failure)
          {
            write(series.file().comm(), {.time = time,
                                         .mesh = &series,
                                         .mesh_fields = {output_fields(node_fields), output_fields(cell_fields)},
                                         .failure = failure});
          },
          py::arg("time"), py::arg("node_fields"), py::arg("cell_fields"), py::arg("failure"))
      .def("close", [](MeshSeries& series) { series.file().close(); });

  py::class_<ModelFields>(m, "ModelFields");
  const auto bind_output = [&m]<class G>(G)
  {
    m.def("model_fields", &model_fields<G>);
    m.def("write_model", &write_model<G>);
  };
  bind_output(PlaneStrain{});
  bind_output(Axisymmetric{});
  bind_output(Solid{});
}
} // namespace mpm::python
