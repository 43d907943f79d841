#!/usr/bin/env bash
# mypy --strict on the package as it is when installed: python/supple with kernels/ inside it.
set -euo pipefail
cd "$(dirname "$0")/.."

tree=build/typecheck/supple
rm -rf "$tree"
mkdir -p "$tree"
ln -s "$PWD"/python/supple/* "$PWD"/kernels "$tree"/
MYPYPATH=build/typecheck .venv/bin/mypy -p supple |
  sed -e 's#build/typecheck/supple/kernels/#kernels/#' -e 's#build/typecheck/#python/#'
