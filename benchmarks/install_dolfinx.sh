#!/usr/bin/env bash
# DOLFINx 0.11 with PETSc, MUMPS and MPICH, from binary wheels, into a virtual environment. Needs a Python of 3.12 or later:
# the first that is found, or PYTHON. Usage: install_dolfinx.sh VENV, then run.py --dolfinx VENV/bin/python
set -euo pipefail
venv=${1:?usage: install_dolfinx.sh VENV}
for python in "${PYTHON:-}" python3.14 python3.13 python3.12 python3; do
  [ -n "$python" ] && "$python" -c 'import ensurepip, sys; sys.exit(sys.version_info < (3, 12))' 2>/dev/null && break
  python=
done
[ -n "$python" ] || { echo "no Python of 3.12 or later; name one: PYTHON=… $0 $venv" >&2; exit 1; }
"$python" -m venv "$venv" && "$venv/bin/pip" install -q dolfinx-solver-real==0.11.0.post0
"$venv/bin/python" -c "from mpi4py import MPI; import dolfinx; print('DOLFINx', dolfinx.__version__)"
