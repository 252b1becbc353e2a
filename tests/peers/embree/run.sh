#!/usr/bin/env bash
# Rays by bitlight and by Embree 4, side by side, as tables in Markdown:
#
#   BITLIGHT_ASSETS=… tests/peers/embree/run.sh >tests/peers/embree/result.md
#
# tests/peers/README.md says what to install.
set -euo pipefail
cd "$(dirname "$0")/../../.."
folder=${CARGO_TARGET_DIR:-target}/peers/embree
mkdir -p "$folder"
if [ ! -d "$folder/embreex.libs" ]; then
  python3 -m pip download --quiet --no-deps --only-binary :all: --dest "$folder" embreex==4.4.0.post1 >&2
  python3 -m zipfile -e "$folder"/embreex-*.whl "$folder"
fi
# No contraction: which rays there are is to be the same on both sides.
cc -O2 -Wall -ffp-contract=off -o "$folder/embree" tests/peers/embree/embree.c "$folder"/embreex.libs/libembree4* \
  -Wl,-rpath,"\$ORIGIN/embreex.libs" -Wl,--allow-shlib-undefined
cargo build --locked --quiet --release --example embree
# value KEY: of the first processor.
value() { awk -F '[[:space:]]*: ' -v key="$1" '$1 == key && !found { print $2; found = 1 }' /proc/cpuinfo; }
echo "Measured on $(date -u +%F), on $(value "model name") (family $(value "cpu family"), model $(value model)) with" \
  "$(nproc) cores, by \`tests/peers/embree/run.sh\`."
echo
"${CARGO_TARGET_DIR:-target}/release/examples/embree" "$folder/embree"
