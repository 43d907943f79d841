#include "supple/system.hpp"

#include <omp.h>

#include "aggregate.hpp"
#include "core.hpp"
#include "supple/kernel_term.hpp"
#include "supple/newton.hpp"
#include "supple/sliding.hpp"
#include "supple/stability.hpp"

namespace {

using supple::Vector;

/// Hands each iteration to Python and lets Ctrl-C through.
supple::Progress python_progress(const py::object& callback) {
  return [&callback](const supple::Iteration& iteration) {
    const py::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (!callback.is_none()) callback(iteration);
  };
}

/// Asks Python about an equilibrium; it answers with an Outcome.
supple::Judge python_judge(const py::object& callback) {
  if (callback.is_none()) return {};
  return [&callback](const Vector& u, double load_factor) {
    const py::gil_scoped_acquire gil;
    return callback(u, load_factor).cast<supple::Outcome>();
  };
}

supple::NewtonResult solve(supple::System& system, const Vector& start, const Vector& prescribed,
                           supple::NewtonSettings settings, const py::object& progress,
                           const py::object& judge) {
  const supple::Progress report = python_progress(progress);
  settings.judge = python_judge(judge);
  const py::gil_scoped_release release;
  return supple::solve(system, start, prescribed, settings, report);
}

/// A copy as an array; py::cast would make a list of Python's numbers first.
template <class Number>
py::array_t<Number> array(const std::vector<Number>& values) {
  return py::array_t<Number>(static_cast<py::ssize_t>(values.size()), values.data());
}

py::tuple tangent(supple::System& system, const Vector& u) {
  const auto assembled = [&]() -> const Vector& {
    const py::gil_scoped_release release;
    system.assemble_tangent(u, 1.0);
    return system.full_tangent();
  };
  const Vector& values = assembled();
  const supple::BlockPattern& pattern = system.pattern();
  return py::make_tuple(values, array(pattern.column), array(pattern.row_start));
}

void bind_terms(py::module_& module) {
  py::class_<supple::VolumeRatio>(module, "VolumeRatio")
      .def_readonly("value", &supple::VolumeRatio::value)
      .def_readonly("cell", &supple::VolumeRatio::cell)
      .def_readonly("term", &supple::VolumeRatio::term);
  py::class_<supple::Term, std::shared_ptr<supple::Term>>(module, "Term")
      .def_readwrite("is_load", &supple::Term::is_load)
      .def_readwrite("is_silent", &supple::Term::is_silent)
      .def("energy", &supple::Term::energy, Unlocked())
      .def(
          "residual",
          [](const supple::Term& term, const Vector& u) {
            Vector r = Vector::Zero(u.size());
            term.residual(u, 1.0, r);
            return r;
          },
          Unlocked())
      .def("volume_ratio", &supple::Term::volume_ratio, Unlocked());
  py::class_<supple::NodalForce, supple::Term, std::shared_ptr<supple::NodalForce>>(module,
                                                                                    "NodalForce")
      .def(py::init<Vector>())
      .def("set_forces", &supple::NodalForce::set_forces);
  py::class_<supple::KernelTerm, supple::Term, std::shared_ptr<supple::KernelTerm>>(module,
                                                                                    "KernelTerm")
      .def(py::init(
          [](const std::string& library, const supple::System& system, const CellArray& cells) {
            return std::make_shared<supple::KernelTerm>(supple::KernelLibrary::load(library),
                                                        system.points(), connectivity(cells),
                                                        system.scalars());
          }))
      .def_property_readonly("cells",
                             [](const supple::KernelTerm& term) { return term.given_cells(); })
      .def_property_readonly(
          "nodes", [](const supple::KernelTerm& term) { return term.library().table().nodes; })
      .def("set_scalar_unit", &supple::KernelTerm::set_scalar_unit)
      .def_property_readonly("fields",
                             [](const supple::KernelTerm& term) {
                               const supple_library& table = term.library().table();
                               std::vector<std::pair<std::string, int>> fields;
                               for (int f = 0; f < table.field_count; ++f)
                                 fields.emplace_back(table.fields[f].name, table.fields[f].size);
                               return fields;
                             })
      .def_property_readonly(
          "quadrature",
          [](const supple::KernelTerm& term) {
            const supple_library& table = term.library().table();
            using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
            return Rows(Eigen::Map<const Rows>(table.points, table.point_count, table.dimension));
          })
      .def("set_field", &supple::KernelTerm::set_field)
      .def("tabulate", &supple::KernelTerm::tabulate, Unlocked())
      .def_property_readonly("weights", [](const supple::KernelTerm& term) {
        const supple_library& table = term.library().table();
        return Vector(Eigen::Map<const Vector>(table.weights, table.point_count));
      });
  py::class_<supple::Sliding, supple::Term, std::shared_ptr<supple::Sliding>>(module, "Sliding")
      .def(py::init([](const supple::System& system, std::vector<supple::Index> nodes,
                       const Vector& stiffness, const supple::Points& vertices,
                       const supple::Triangles& triangles, bool inverse) {
             return std::make_shared<supple::Sliding>(system.points(), std::move(nodes), stiffness,
                                                      vertices, triangles, inverse);
           }),
           Unlocked());
}

void bind_newton(py::module_& module) {
  using supple::Iteration;
  using supple::NewtonResult;
  using supple::NewtonSettings;
  using supple::Outcome;
  py::enum_<Outcome>(module, "Outcome")
      .value("converged", Outcome::Converged)
      .value("unstable", Outcome::Unstable)
      .value("inverted", Outcome::Inverted)
      .value("singular", Outcome::Singular)
      .value("limit_point", Outcome::LimitPoint)
      .value("stalled", Outcome::Stalled);
  py::class_<NewtonSettings>(module, "NewtonSettings")
      .def(py::init<>())
      .def_readwrite("rtol", &NewtonSettings::rtol)
      .def_readwrite("atol", &NewtonSettings::atol)
      .def_readwrite("step_tol", &NewtonSettings::step_tol)
      .def_readwrite("size", &NewtonSettings::size)
      .def_readwrite("max_iterations", &NewtonSettings::max_iterations)
      .def_readwrite("load_steps", &NewtonSettings::load_steps)
      .def_readwrite("kinks", &NewtonSettings::kinks)
      .def_readwrite("follow", &NewtonSettings::follow)
      .def_readwrite("refuse_inversion", &NewtonSettings::refuse_inversion)
      .def_readwrite("warm", &NewtonSettings::warm);
  py::class_<Iteration>(module, "Iteration")
      .def_readonly("load_factor", &Iteration::load_factor)
      .def_readonly("iteration", &Iteration::iteration)
      .def_readonly("residual", &Iteration::residual)
      .def_readonly("tolerance", &Iteration::tolerance)
      .def_readonly("step", &Iteration::step)
      .def_readonly("length", &Iteration::length)
      .def_readonly("shift", &Iteration::shift);
  py::class_<NewtonResult>(module, "NewtonResult")
      .def_readonly("outcome", &NewtonResult::outcome)
      .def_readonly("u", &NewtonResult::u)
      .def_readonly("load_factor", &NewtonResult::load_factor)
      .def_readonly("fold", &NewtonResult::fold)
      .def_readonly("residual", &NewtonResult::residual)
      .def_readonly("history", &NewtonResult::history)
      .def_readonly("worst", &NewtonResult::worst)
      .def_readonly("last_residual", &NewtonResult::last_residual)
      .def_readonly("negative", &NewtonResult::negative);
}

} // namespace

void bind_system(py::module_& module) {
  using supple::System;
  bind_terms(module);
  bind_newton(module);
  py::class_<supple::Timings>(module, "Timings")
      .def_readonly("analysis", &supple::Timings::analysis)
      .def_readonly("residual", &supple::Timings::residual)
      .def_readonly("assembly", &supple::Timings::assembly)
      .def_readonly("factor", &supple::Timings::factor)
      .def_readonly("solve", &supple::Timings::solve)
      .def_readonly("total", &supple::Timings::total)
      .def_readonly("factorisations", &supple::Timings::factorisations)
      .def_readonly("krylov_iterations", &supple::Timings::krylov_iterations);
  py::enum_<supple::Method>(module, "Method")
      .value("direct", supple::Method::Direct)
      .value("pardiso", supple::Method::Pardiso)
      .value("cg", supple::Method::Kept)
      .value("multigrid", supple::Method::Grid);
  py::class_<System>(module, "System")
      .def(py::init([](Vector points, std::vector<supple::Index> home) {
        return std::make_unique<System>(std::make_shared<Vector>(std::move(points)),
                                        std::move(home));
      }))
      .def_property_readonly("scalars", &System::scalars)
      .def("add", &System::add)
      .def("move_points", &System::move_points)
      .def("set_free", &System::set_free)
      .def("use_gmres", &System::use_gmres)
      .def("use_method", &System::use_method)
      .def("predicted_factor", &System::predicted_factor)
      .def("forget_kept", &System::forget_kept)
      .def("use_grid",
           [](System& system, std::vector<supple::Index> start, std::vector<supple::Index> corner,
              const py::function& aggregate) {
             system.use_grid({std::move(start), std::move(corner)}, python_aggregate(aggregate));
           })
      .def("energy", &System::energy, Unlocked())
      .def("residual",
           py::overload_cast<const supple::ConstVector&, double>(&System::residual, py::const_),
           Unlocked())
      .def("external", &System::external, Unlocked())
      .def("volume_ratio", &System::volume_ratio, Unlocked())
      .def("tangent", &tangent)
      .def("has_energy", &System::has_energy)
      .def("is_minimised",
           [](const System& s) { return s.has_energy() && s.kind() == supple::Kind::Cholesky; })
      .def(
          "unstable_directions",
          [](System& system, const Vector& u, const System* inverse) {
            return supple::unstable_directions(system, u, inverse);
          },
          Unlocked(), py::arg("u"), py::arg("inverse") = nullptr)
      .def("reset_timings", [](System& system) { system.timings = {}; })
      .def_readonly("timings", &System::timings)
      .def("solve", &solve);
  module.def("connected_pieces", [](supple::Index nodes, const CellArray& cells) {
    const std::vector<supple::Index> piece = supple::connected_pieces(nodes, connectivity(cells));
    return py::array_t<supple::Index>(static_cast<py::ssize_t>(piece.size()), piece.data());
  });
  module.def("set_threads", [](int threads) { omp_set_num_threads(threads); });
  module.def("threads", [] { return omp_get_max_threads(); });
}
