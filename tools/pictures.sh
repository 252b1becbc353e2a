#!/usr/bin/env bash
# Makes the pictures of README.md anew, or with --check tells whether they are what the code makes.
set -euo pipefail
cd "$(dirname "$0")/.."
out=$(mktemp -d)
trap 'rm -r "$out"' EXIT
cargo run --quiet --release -- render scenes/translucency/knot.toml --passes all -o "$out" >/dev/null
for picture in knot.png knot.passes.png; do
  if [[ ${1:-} == --check ]]; then
    cmp "$out/$picture" "docs/$picture" || { echo "docs/$picture is not what the code makes: run tools/pictures.sh"; exit 1; }
  else
    cp "$out/$picture" "docs/$picture"
  fi
done
