#!/usr/bin/env bash
# Radiance by bitlight's truth and by Mitsuba 3, side by side, as a table in Markdown; writes the tables of Mitsuba's that
# tests/peers_mitsuba.rs reads:
#
#   tests/peers/mitsuba/run.sh >tests/peers/mitsuba/result.md
#
# tests/peers/README.md says what to install.
set -euo pipefail
cd "$(dirname "$0")/../../.."
folder=${CARGO_TARGET_DIR:-target}/peers/mitsuba
if [ ! -x "$folder/venv/bin/python" ]; then
  python3 -m venv "$folder/venv" >&2
  "$folder/venv/bin/python" -m pip install --quiet mitsuba==3.9.1 numpy >&2
fi
cargo build --locked --quiet --release --example mitsuba
# value KEY: of the first processor.
value() { awk -F '[[:space:]]*: ' -v key="$1" '$1 == key && !found { print $2; found = 1 }' /proc/cpuinfo; }
echo "Measured on $(date -u +%F), on $(value "model name") (family $(value "cpu family"), model $(value model)) with" \
  "$(nproc) cores, by \`tests/peers/mitsuba/run.sh\`."
echo
"${CARGO_TARGET_DIR:-target}/release/examples/mitsuba" "$folder"
