#!/usr/bin/env bash
# Makes .venv/ ready to build in: compilers and libraries first, then a Python environment.
#
# What is missing is installed with apt when that needs no question (root, or sudo without a
# password); otherwise the one command to run is named and the script stops with exit code 1.
# PYTHON=/path/to/python chooses the interpreter; else the first of the list below that is >= 3.11.
set -euo pipefail
cd "$(dirname "$0")/.."

tools=(g++ cmake ninja)
libraries=(libeigen3-dev libsuitesparse-dev libopenblas-dev)

stop() {
  echo "setup: $*" >&2
  exit 1
}

is_new_enough() {
  "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1
}

find_python() {
  local candidate
  for candidate in ${PYTHON:-python3 python3.13 python3.12 python3.11}; do
    if is_new_enough "$candidate"; then
      command -v "$candidate"
      return
    fi
  done
}

# The Debian packages that $1, an interpreter (may be empty), still needs to make environments
# and to compile extension modules.
python_packages() {
  if [ -z "$1" ]; then
    echo python3 python3-venv python3-dev
    return
  fi
  local name
  name=python3
  [ "$(readlink -f "$1")" = "$(readlink -f /usr/bin/python3)" ] ||
    name=$("$1" -c 'import sys; print("python%d.%d" % sys.version_info[:2])')
  "$1" -c 'import venv, ensurepip' 2>/dev/null || echo "$name-venv"
  "$1" -c 'import os, sys, sysconfig
header = os.path.join(sysconfig.get_path("include"), "Python.h")
sys.exit(not os.path.exists(header))' || echo "$name-dev"
}

missing_packages() {
  local tool library
  for tool in "${tools[@]}"; do
    command -v "$tool" >/dev/null || echo "${tool/%ninja/ninja-build}"
  done
  for library in "${libraries[@]}"; do
    [[ $(dpkg-query -W -f '${Status}' "$library" 2>/dev/null) == *" installed" ]] || echo "$library"
  done
  python_packages "$1"
}

install_packages() {
  local as_root=()
  if [ "$(id -u)" != 0 ]; then
    sudo -n true 2>/dev/null ||
      stop "run this once, then repeat: sudo apt-get update && sudo apt-get install -y $*"
    as_root=(sudo -n)
  fi
  echo "setup: installing $*"
  "${as_root[@]}" apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq \
    --no-install-recommends "$@" >/dev/null
}

make_environment() {
  if is_new_enough .venv/bin/python && .venv/bin/python -m pip --version >/dev/null 2>&1; then
    return
  fi
  echo "setup: making .venv with $1"
  "$1" -m venv --clear .venv
}

if command -v apt-get >/dev/null; then
  mapfile -t packages < <(missing_packages "$(find_python)" | tr ' ' '\n')
  [ "${#packages[@]}" = 0 ] || install_packages "${packages[@]}"
else
  for tool in "${tools[@]}"; do
    command -v "$tool" >/dev/null ||
      stop "$tool is missing; install a C++17 compiler, CMake, Ninja, Eigen, SuiteSparse, OpenBLAS"
  done
fi
python=$(find_python)
[ -n "$python" ] || stop "Python 3.11 or newer is needed; name one with PYTHON=/path/to/python"
make_environment "$python"
