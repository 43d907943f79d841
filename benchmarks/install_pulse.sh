#!/usr/bin/env bash
# fenicsx-pulse into a virtual environment that has DOLFINx 0.11 (dolfinx-solver-real), for rest_peers.py.
# Its requirement fenics-dolfinx is that wheel under another name, so it is not asked for. scifem's C++ extension needs
# DOLFINx' headers, which the wheel lacks: its Python is installed alone, with an extension whose functions (real spaces,
# closest points) raise; pulse calls none of them for a solid block. Usage: install_pulse.sh VENV
set -euo pipefail
pip=${1:?usage: install_pulse.sh VENV}/bin/pip
"$pip" install -q packaging pint rich rich-argparse scipy setuptools
"$pip" install -q --no-deps fenicsx-pulse==0.12.0 fenicsx-compat
work=$(mktemp -d) && trap 'rm -rf "$work"' EXIT && cd "$work"
"$pip" download -q --no-deps --no-binary scifem scifem==0.27.0
tar xf scifem-*.tar.gz && cd scifem-*/
cat > pyproject.toml <<'TOML'
[build-system]
requires = ["setuptools"]
build-backend = "setuptools.build_meta"
[project]
name = "scifem"
version = "0.27.0"
[tool.setuptools.packages.find]
where = ["src"]
TOML
cat > src/scifem/_scifem.py <<'PYTHON'
def _absent(*_):
    raise NotImplementedError("scifem's C++ extension is not built")


def __getattr__(name):
    if name.startswith("__"):
        raise AttributeError(name)
    return _absent
PYTHON
rm -f CMakeLists.txt && "$pip" install -q --no-deps --no-build-isolation .
cd / && "${pip%/pip}/python" -c "from mpi4py import MPI; import pulse; print('fenicsx-pulse', pulse.__version__)"
