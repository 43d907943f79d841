#!/usr/bin/env bash
# FElupe with einsum in threads and MKL's Pardiso (not open source; leave it out with OPEN=1, and SuperLU solves), into a
# virtual environment. Usage: install_felupe.sh VENV, then run.py --felupe VENV/bin/python
set -euo pipefail
venv=${1:?usage: install_felupe.sh VENV}
"${PYTHON:-python3}" -m venv "$venv"
"$venv/bin/pip" install -q felupe==11.3.0 einsumt tensortrax scipy
[ -n "${OPEN:-}" ] || "$venv/bin/pip" install -q pypardiso
"$venv/bin/python" -c "import felupe; print('FElupe', felupe.__version__)"
