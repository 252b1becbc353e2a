#!/usr/bin/env bash
# tools/cross.sh [FOLDER] ARCH: what builds for another processor and runs the programs here. Afterwards
#
#     . FOLDER/ARCH.env && cargo test --target "$CROSS_TARGET"
#
# needs no flag more. ARCH is arm64, armhf, i386, ppc64el, riscv64, s390x (big-endian) or amd64 (this processor, for
# the emulator alone), as Debian calls them, or wasm32-unknown-unknown (for browsers) or wasm32-wasip1 (run by node).
# The environment has RUSTC, RUSTDOC and CROSS_TARGET, cargo's linker and runner, and the runner as CROSS_RUN; for
# wasm32-unknown-unknown there is no runner. FOLDER is target/cross if not given. What is complete there stays.
#
# rustup's standard library for ARCH is taken where it is installed. Elsewhere Debian's rustc-web is unpacked below
# FOLDER, with the standard library of the same release: from a suite that has it, or built from the sources. The
# emulator is unpacked too: that of Debian 12, qemu 7.2, multiplies f32 to f64 wrongly on s390x. The cross compiler
# for C, which links, and node are all that is installed on the machine, by root.
#
# Exit status 3: this machine has neither Debian nor what is needed. 1: all other failures.
set -euo pipefail

fail() {
  echo "cross.sh: $*" >&2
  exit 1
}

# What this machine has not and cannot have is an end of its own, for which a caller may leave something out.
lacks() {
  echo "cross.sh: $*" >&2
  exit 3
}

(($# == 1 || $# == 2)) || fail "usage: tools/cross.sh [FOLDER] ARCH"
arch=${!#}
c='' qemu=''
case $arch in
  amd64) target=x86_64-unknown-linux-gnu c=x86_64-linux-gnu qemu=x86_64 ;;
  arm64) target=aarch64-unknown-linux-gnu c=aarch64-linux-gnu qemu=aarch64 ;;
  armhf) target=armv7-unknown-linux-gnueabihf c=arm-linux-gnueabihf qemu=arm ;;
  i386) target=i686-unknown-linux-gnu c=i686-linux-gnu qemu=i386 ;;
  ppc64el) target=powerpc64le-unknown-linux-gnu c=powerpc64le-linux-gnu qemu=ppc64le ;;
  riscv64) target=riscv64gc-unknown-linux-gnu c=riscv64-linux-gnu qemu=riscv64 ;;
  s390x) target=s390x-unknown-linux-gnu c=s390x-linux-gnu qemu=s390x ;;
  wasm32-unknown-unknown | wasm32-wasip1) target=$arch ;;
  *) fail "ARCH is $arch, which the head of this script does not name" ;;
esac
folder=$(dirname "$0")/../target/cross
(($# == 1)) || folder=$1
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
root=$folder/root libraries=$folder/root/usr/lib/rustlib

debian() {
  command -v apt-get >/dev/null && [[ $(dpkg --print-architecture) == amd64 ]]
}

# install PACKAGE...: on the machine.
install() {
  debian || lacks "$* must be installed, and this script installs on Debian for x86-64 alone"
  ((EUID == 0)) || lacks "$* must be installed: only root may"
  local apt=(env DEBIAN_FRONTEND=noninteractive apt-get -qq -o DPkg::Lock::Timeout=300)
  "${apt[@]}" install -y --no-install-recommends "$@" &>/dev/null ||
    # Lists that are older than the mirror name files that it has no more.
    { "${apt[@]}" update && "${apt[@]}" install -y --no-install-recommends "$@" >/dev/null; } ||
    fail "$* cannot be installed"
}

# unpack PACKAGE RELEASE [PATH...]: a package whose version begins with RELEASE, or of its paths these, below $root.
unpack() {
  local debs=$folder/debs version
  version=$(apt-cache madison "$1" | awk -v release="$2" 'index($3, release) == 1 && !found++ { print $3 }')
  [[ -n $version ]] || return
  rm -rf "$debs"
  mkdir -p "$debs" "$root"
  (cd "$debs" && apt-get -qq -o APT::Sandbox::User=root download "$1=$version") &&
    dpkg --fsys-tarfile "$debs"/*.deb | tar -x -C "$root" "${@:3}" &&
    rm -r "$debs"
}

# unpack_from SUITE ARCH PACKAGE RELEASE [PATH...]: the same from a suite of Debian, for a processor, that the machine
# need not know: apt works on lists and a status of its own, from the mirror that the machine uses.
unpack_from() {
  local own=$folder/apt mirror
  # shellcheck disable=SC2016 # the variable is apt's
  mirror=$(apt-get indextargets --format '$(SITE)' 'Created-By: Packages' | sed -n '1s,/[^/]*$,,p')
  rm -rf "$own"
  mkdir -p "$own"/{state/lists/partial,cache/archives/partial,no.parts}
  : >"$own/status"
  echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror/$1 main" >"$own/sources"
  cat >"$own/conf" <<CONF
APT { Architecture "$2"; Architectures { "$2"; }; Sandbox::User "root"; };
Dir { State "$own/state"; State::status "$own/status"; Cache "$own/cache"; };
Dir::Etc { sourcelist "$own/sources"; sourceparts "$own/no.parts"; };
Acquire { Languages "none"; IndexTargets::deb::DEP-11::DefaultEnabled "false"; };
CONF
  (
    export APT_CONFIG=$own/conf
    # A mirror's lists can be out of step with each other; then the next suite is asked.
    apt-get -qq update 2>/dev/null && unpack "${@:3}"
  ) && rm -r "$own"
}

# program NAME PATH: FOLDER/NAME, which runs what lies at that path below $root.
program() {
  cat >"$folder/$1" <<PROGRAM
#!/bin/sh
LD_LIBRARY_PATH='$root/usr/lib/x86_64-linux-gnu' exec '$root/$2' "\$@"
PROGRAM
  chmod +x "$folder/$1"
}

unpack_compiler() {
  local package
  ((EUID != 0)) || apt-get -qq update || true # another apt may be at it, or old lists may do
  # An installation on an empty machine would bring in these, LLVM's and the standard library's exact names included.
  # The compiler's own libraries are unpacked in any case; what else it takes is on nearly all machines.
  while read -r package; do
    if [[ $package =~ ^(rustc-web|libstd-rust-web|libllvm|libz3) ]] || ! dpkg -s "$package" &>/dev/null; then
      unpack "$package" "" || fail "$package cannot be had"
    fi
  done < <(apt-get -s -o Dir::State::status=/dev/null --no-install-recommends install rustc-web |
    awk '$1 == "Inst" { print $2 }')
  program rustdoc usr/bin/rustdoc
  program rustc usr/bin/rustc # last: it stands for all of it
}

unpack_library() {
  local suite
  for suite in "debian-security bookworm-security" "debian trixie" "debian-security trixie-security"; do
    ! unpack_from "$suite" "$arch" libstd-rust-web-dev "$release+" || return 0
  done
  return 1
}

# Debian's sources of the standard library have all that it depends on. cargo builds it as a part of some program, and
# that is an empty one here.
build_library() {
  local build=$folder/std sources=$libraries/src/rust/library crates=std,panic_abort
  [[ $target == wasm32-unknown-unknown ]] || crates+=,test # nothing runs there, so no test does
  [[ -d $sources/vendor ]] ||
    unpack rust-web-src "$release+" ./usr/lib/rustlib/src "./usr/src/rustc-$release/library" ||
    fail "there are neither rust-web-src $release nor a libstd-rust-web-dev $release for $arch"
  mkdir -p "$build/src"
  echo '#![no_std]' >"$build/src/lib.rs"
  printf '%s\n' '[package]' 'name = "nothing"' 'edition = "2024"' '[workspace]' >"$build/Cargo.toml"
  # RUSTC_BOOTSTRAP lets a stable compiler do so. Programs with LTO need the bitcode.
  (cd "$build" && RUSTC_BOOTSTRAP=1 RUSTFLAGS="-C embed-bitcode=yes" CARGO_INCREMENTAL=0 \
    cargo build --quiet --offline --release -Z build-std="$crates" --target "$target" --target-dir target \
    --config 'source.crates-io.replace-with = "vendor"' --config "source.vendor.directory = '$sources/vendor'")
  rm -rf "${libraries:?}/$target"
  mkdir -p "$libraries/$target/lib"
  mv "$build/target/$target"/release/deps/*.rlib "$libraries/$target/lib"
  rm "$libraries/$target"/lib/libnothing-*.rlib
  rm -r "$build"
}

# What programs of wasm32-wasip1 begin with is wasi-libc's, and thread functions beside it, which Debian 12's lacks and
# the standard library names: all of them fail.
wasi_libc() {
  local lib=$libraries/$target/lib/self-contained functions='#![no_std]' name
  unpack wasi-libc "" ./usr/lib/wasm32-wasi
  for name in attr_init attr_setstacksize attr_destroy create join detach; do
    functions+=" #[unsafe(no_mangle)] extern \"C\" fn pthread_$name(_: usize, _: usize, _: usize, _: usize) -> i32 { 58 }"
  done
  "$RUSTC" --target "$target" --crate-type lib --emit obj -O -o "$folder/pthread.o" - <<<"$functions"
  mkdir -p "$lib"
  cp "$root"/usr/lib/wasm32-wasi/{crt1-reactor.o,libc.a} "$lib"
  "$linker" --relocatable -o "$lib/crt1-command.o" "$root/usr/lib/wasm32-wasi/crt1-command.o" "$folder/pthread.o"
  rm "$folder/pthread.o"
}

node_runner() {
  command -v node >/dev/null || install nodejs
  cat >"$folder/wasi.mjs" <<'NODE'
// node wasi.mjs PROGRAM ARGUMENT...: runs a program for wasm32-wasip1, which sees the current folder.
import { readFileSync } from "node:fs";
import { WASI } from "node:wasi";
const args = process.argv.slice(2);
const wasi = new WASI({ version: "preview1", args, env: process.env, preopens: { [process.cwd()]: ".", ".": "." } });
const imports = { wasi_snapshot_preview1: wasi.wasiImport };
const { instance } = await WebAssembly.instantiate(readFileSync(args[0]), imports);
process.exitCode = wasi.start(instance);
NODE
  run="node --no-warnings $folder/wasi.mjs"
}

c_compiler() {
  linker=$c-gcc sysroot=/usr/$c
  if [[ $arch == amd64 ]]; then
    linker=cc sysroot=/
  elif ! command -v "$linker" >/dev/null || [[ ! -e $sysroot/lib/libc.so.6 ]]; then
    install "gcc-$c" "libc6-dev-$arch-cross"
  fi
}

emulator() {
  local suite
  if debian && [[ ! -x $root/usr/bin/qemu-$qemu ]]; then
    for suite in "debian bookworm-backports" "debian trixie"; do
      ! unpack_from "$suite" amd64 qemu-user "" \
        ./usr/bin/qemu-{aarch64,arm,i386,ppc64le,riscv64,s390x,x86_64} || break
    done
  fi
  run=$root/usr/bin/qemu-$qemu
  [[ -x $run ]] || run=$(command -v "qemu-$qemu") || lacks "there is no qemu-$qemu"
  run+=" -L $sysroot"
}

# A program that multiplies must come out, and run, before the folder counts as complete.
try() {
  "$RUSTC" --target "$target" ${linker:+-C linker="$linker"} -O -o "$folder/try" - <<'RUST'
fn main() {
    let [a, b] = std::hint::black_box([1.5_f32, 2.5]);
    print!("{}", f64::from(a) * f64::from(b));
}
RUST
  if [[ $arch == i386 ]]; then
    # Most kernels of x86-64 run i386 as it is, many times as fast as an emulator.
    local direct="$sysroot/lib/ld-linux.so.2 --library-path $sysroot/lib"
    [[ $($direct "$folder/try" 2>/dev/null) != 3.75 ]] || run=$direct
  fi
  [[ -z $run || $($run "$folder/try") == 3.75 ]] || fail "a program for $arch multiplies wrongly, or does not run"
  rm "$folder/try"
}

if [[ ! -f $folder/$arch.env ]]; then
  export RUSTC=rustc RUSTDOC=rustdoc
  linker='' run=''
  has_library() { compgen -G "$("$RUSTC" --print target-libdir --target "$target")/libstd-*.rlib" >/dev/null; }
  if ! has_library; then
    debian || lacks "rustup target add $target, or run this on Debian for x86-64"
    RUSTC=$folder/rustc RUSTDOC=$folder/rustdoc
    [[ -x $RUSTC ]] || unpack_compiler
    release=$("$RUSTC" --version | cut -d ' ' -f 2)
    if [[ -z $c ]]; then
      llvm=$("$RUSTC" -vV | sed -n 's/^LLVM version: \([0-9]*\).*/\1/p')
      linker=$folder/wasm-ld
      if [[ ! -x $linker ]]; then
        unpack "lld-$llvm" "" || fail "lld-$llvm cannot be had"
        program wasm-ld "usr/lib/llvm-$llvm/bin/wasm-ld"
      fi
    fi
    has_library || { [[ -n $c ]] && unpack_library; } || build_library
    [[ $arch != wasm32-wasip1 ]] || wasi_libc
  fi
  if [[ -n $c ]]; then
    c_compiler
    emulator
  elif [[ $arch == wasm32-wasip1 ]]; then
    node_runner
  fi
  try
  name=CARGO_TARGET_${target^^}
  name=${name//-/_}
  {
    echo "export RUSTC='$RUSTC' RUSTDOC='$RUSTDOC' CROSS_TARGET=$target CROSS_RUN='$run'"
    [[ -z $linker ]] || echo "export ${name}_LINKER='$linker'"
    [[ -z $run ]] || echo "export ${name}_RUNNER='$run'"
  } >"$folder/$arch.part"
  mv "$folder/$arch.part" "$folder/$arch.env" # last: it stands for all of it
fi
# shellcheck disable=SC1090 # it is written above
. "$folder/$arch.env"
echo "$target: $("$RUSTC" --version)${CROSS_RUN:+, $(${CROSS_RUN%% *} --version | sed -n 1p)}"
