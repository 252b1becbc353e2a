#!/usr/bin/env bash
# The proof of the determinism contract: examples/proof.rs under every build profile, instruction set and number of
# threads that the contract names, against the one manifest of each scene. Every run must agree with it, and all must
# print the same digest of what they rendered.
#
# qemu and the cross compiler are installed where they are missing and this is root on Debian. Where they cannot be,
# that proof is skipped with its reason; under CI=true that is a failure.
set -euo pipefail
cd "$(dirname "$0")/.."
export CARGO_TERM_COLOR=never CARGO_INCREMENTAL=0
# Flags of the machine's own would make a baseline binary another; each build below says its flags.
unset RUSTFLAGS CARGO_ENCODED_RUSTFLAGS BITLIGHT_THREADS

target=${CARGO_TARGET_DIR:-target}
threads=(--no-default-features --features threads)
single=(--no-default-features)
failed=0 runs=0 digest=

fail() {
  echo "FAILED: $*"
  failed=1
}

skip() {
  if [[ ${CI:-} == true ]]; then fail "$*"; else echo "skipped: $*"; fi
}

# Beside the machine's own release build, which shares target with all else, each set of flags has a folder of its
# own and builds every crate anew. There, what is heavy and lies off the golden path (a proof reads no picture) is
# not optimised.
separate=(--release "${threads[@]}" --config profile.release.debug=false)
for crate in image moxcms png proptest regex-syntax; do
  separate+=(--config "profile.release.package.$crate.opt-level=0")
done

# build TEXT FOLDER ARGUMENT...: builds the proof below FOLDER.
build() {
  local text=$1 folder=$2 began=$SECONDS
  shift 2
  CARGO_TARGET_DIR=$folder cargo build --locked --quiet --example proof "$@"
  printf 'built %-40s %4d s\n' "$text" $((SECONDS - began))
}

# prove TEXT COMMAND...: runs the proof, and holds its digest against the first run's.
prove() {
  local text=$1 began=${EPOCHREALTIME/[.,]/} output status=0 last milliseconds
  shift
  output=$("$@" 2>&1) || status=$?
  milliseconds=$(((${EPOCHREALTIME/[.,]/} - began) / 1000))
  last=${output##*$'\n'}
  if ((runs == 0)); then
    echo "$output"
    digest=$last
  fi
  runs=$((runs + 1))
  if ((status != 0)); then
    echo "$output"
    fail "$text: exit status $status"
  elif [[ $last != "$digest" ]]; then
    fail "$text: $last, but the first run had $digest"
  else
    printf 'same  %-40s %4d.%03d s\n' "$text" $((milliseconds / 1000)) $((milliseconds % 1000))
  fi
}

# qemu NAME: whether that emulator is there, perhaps now.
qemu() {
  command -v "qemu-$1" >/dev/null && return
  command -v apt-get >/dev/null && ((EUID == 0)) || return
  apt-get -qq update && DEBIAN_FRONTEND=noninteractive apt-get -qq install -y qemu-user >/dev/null
  command -v "qemu-$1" >/dev/null
}

# runs_here CPU: whether this processor has every feature that rustc knows of CPU.
runs_here() {
  features() { rustc --print cfg -C target-cpu="$1" | grep ^target_feature | sort; }
  [[ -z $(comm -23 <(features "$1") <(features native)) ]]
}

rustc -vV | sed -n '1p; /^LLVM/p'
grep -m 1 '^model name' /proc/cpuinfo || true

build debug "$target" "${threads[@]}"
prove debug "$target/debug/examples/proof"

build "release, one thread and no pool" "$target" --release "${single[@]}"
prove "release, one thread and no pool" "$target/release/examples/proof"

build release "$target" --release "${threads[@]}"
prove release "$target/release/examples/proof"
for number in 1 2 3 7; do
  prove "release, threads: $number" env BITLIGHT_THREADS=$number "$target/release/examples/proof"
done

if [[ $(uname -m) == x86_64 ]]; then
  baseline=$target/proofs/x86-64/release/examples/proof
  RUSTFLAGS="-C target-cpu=x86-64" build x86-64 "$target/proofs/x86-64" "${separate[@]}"
  prove x86-64 "$baseline"

  RUSTFLAGS="-C target-cpu=x86-64-v3" build x86-64-v3 "$target/proofs/x86-64-v3" "${separate[@]}"
  if runs_here x86-64-v3; then
    prove x86-64-v3 "$target/proofs/x86-64-v3/release/examples/proof"
  elif qemu x86_64; then
    prove "x86-64-v3, Haswell under qemu" \
      qemu-x86_64 -cpu Haswell "$target/proofs/x86-64-v3/release/examples/proof"
  else
    skip "x86-64-v3: neither this processor nor a qemu-x86_64 runs it"
  fi

  if qemu x86_64; then
    qemu-x86_64 --version | sed -n 1p
    # A processor with AVX-512 takes the widest side of every loop: here the middle one runs.
    prove "release, Haswell under qemu" qemu-x86_64 -cpu Haswell "$target/release/examples/proof"
    # No AVX and no FMA there: the very binary that ran with both must find other ways to the same bits.
    prove "release, Nehalem under qemu" qemu-x86_64 -cpu Nehalem "$target/release/examples/proof"
    prove "x86-64, Nehalem under qemu" qemu-x86_64 -cpu Nehalem "$baseline"
  else
    skip "Nehalem: there is no qemu-x86_64 (Debian's package qemu-user)"
  fi
else
  skip "x86-64: this machine is none"
fi

arm=$target/proofs/aarch64
if tools/aarch64.sh "$target/aarch64"; then
  aarch64-linux-gnu-gcc --version | sed -n 1p
  qemu-aarch64 --version | sed -n 1p
  # shellcheck disable=SC1091 # it is written by aarch64.sh
  . "$target/aarch64/env"
  build aarch64 "$arm" --target aarch64-unknown-linux-gnu "${separate[@]}"
  read -ra runner <<<"$CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER"
  prove "aarch64 under qemu" "${runner[@]}" "$arm/aarch64-unknown-linux-gnu/release/examples/proof"
else
  skip "aarch64: there is no cross toolchain, for the reason above"
fi

# A proof that cannot fail proves nothing: with one digit of one digest turned in every manifest, it must fail.
copy=$(mktemp -d)
trap 'rm -r "$copy"' EXIT
proof=$(realpath "$target/release/examples/proof")
cp -r scenes golden "$copy"
find "$copy/golden" -name '*.json' -exec \
  sed -i -E '0,/"digest": "/ { s/("digest": ")0/\11/; t; s/("digest": ")[1-9a-f]/\10/ }' {} +
status=0
output=$(cd "$copy" && "$proof") || status=$?
if ((status == 1)) && [[ $output == *"differs first"* ]]; then
  echo "noticed: a turned digit (${output%%$'\n'*})"
else
  fail "a turned digit of a digest goes unnoticed: exit status $status, $output"
fi

((failed == 0)) || exit 1
echo "ok: $runs runs, one digest: $digest"
