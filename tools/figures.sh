#!/usr/bin/env bash
# Makes pictures after the figures of the translucency paper: tools/figures.sh --help
set -euo pipefail

known=(teaser 5 6 7 8 9 10 11 12 13)
usage() {
  cat <<'HELP'
tools/figures.sh [-o FOLDER] [teaser] [5] [6] [7] [8] [9] [10] [11] [12] [13]

Makes pictures after figures of the translucency paper, all of them if no number is given, from the scenes
scenes/assets/translucency/figure-NUMBER.toml and teaser.toml, 13b from scenes/assets/prt/. They need the Stanford models, in the folder that the variable
BITLIGHT_ASSETS names. FOLDER is target/figures if not given; figure-NUMBER.png is the picture, FOLDER/parts has
the images that it is made of.

   teaser  a: direct light only, b: with light scattered in the solid
   5  a: attenuation by thickness, b: radiosity, c: their product
   6  radiosity of a coarse model, a: per pixel, b: per vertex, c: difference times 10
   7  radiosity, a: with shift, b: with blindness, c: with neither
   8  the external cubemap, a: as it is, b: scaled to the solid's box
   9  a: without the second layer, b: with it
  10  a: direct light only, b: with light scattered in the solid
  11  the same of the bunny
  12  three frames of a sine deformer
  13  a: this technique, b: precomputed radiance transfer with the dipole, its lights made distant

Example: BITLIGHT_ASSETS=~/models tools/figures.sh 6
HELP
}

fail() {
  echo "figures.sh: $*" >&2
  exit 2
}

out='' figures=()
while (($#)); do
  case $1 in
    -h | --help) usage; exit ;;
    -o) (($# > 1)) || fail "-o takes a folder"; out=$2; shift ;;
    *) [[ " ${known[*]} " == *" $1 "* ]] || fail "there is no figure $1 here, only ${known[*]}; see --help"
      figures+=("$1") ;;
  esac
  shift
done
((${#figures[@]})) || figures=("${known[@]}")
[[ -n ${BITLIGHT_ASSETS:-} ]] ||
  fail "the figures need the Stanford models: set BITLIGHT_ASSETS to the folder that has stanford/buddha.obj (CREDITS.md)"
out=$(realpath -m "${out:-$(dirname "$0")/../target/figures}")
BITLIGHT_ASSETS=$(realpath -m "$BITLIGHT_ASSETS")
export BITLIGHT_ASSETS
cd "$(dirname "$0")/.."

cargo build --quiet --release
bitlight=$(realpath "${CARGO_TARGET_DIR:-target}")/release/bitlight

# render SCENE PART ARGUMENT...: the images of a part of a figure.
render() {
  "$bitlight" render "scenes/assets/translucency/$1.toml" -o "$out/parts/$2" "${@:3}" >/dev/null
}

# join NUMBER ARGUMENT...: the picture.
join() {
  (cd "$out/parts" && "$bitlight" join -o "$out/figure-$1.png" "${@:2}")
}

figure_5() {
  render figure-5 5 --passes attenuation,radiosity,final
  join 5 5/figure-5.exr:{attenuation,radiosity,final} --label "a attenuation" --label "b radiosity" --label "c both"
}

figure_6() {
  render figure-6 6a --passes radiosity
  render figure-6 6b --passes radiosity --set translucency.evaluation=vertex
  join 6 6{a,b}/figure-6.exr --label "a per pixel" --label "b per vertex" --difference 10 \
    --label "c difference x 10"
}

figure_teaser() {
  render teaser teaser-a --set translucency.show=direct
  render teaser teaser-b
  join teaser teaser-{a,b}/teaser.exr --label "a direct light" --label "b with scattered light"
}

figure_7() {
  render figure-7 7a --passes radiosity --set translucency.shift_cure=false
  render figure-7 7b --passes radiosity --set translucency.blindness_cure=false
  render figure-7 7c --passes radiosity
  join 7 7{a,b,c}/figure-7.exr --label "a shift" --label "b blindness" --label "c neither"
}

figure_8() {
  render figure-8 8a --passes transmit --set translucency.blindness_cure=false
  render figure-8 8b --passes transmit
  join 8 8{a,b}/figure-8.exr --label "a as it is" --label "b scaled"
}

figure_13() {
  render figure-13 13a
  render ../prt/figure-13 13b
  join 13 13{a,b}/figure-13.exr --label "a this technique" --label "b radiance transfer"
}

figure_9() {
  render figure-9-ghosts 9a
  render figure-9 9b
  join 9 9a/figure-9-ghosts.exr 9b/figure-9.exr --label "a without the second layer" --label "b with it"
}

figure_10() {
  render "figure-$1" "$1a" --set translucency.show=direct
  render "figure-$1" "$1b"
  join "$1" "$1"{a,b}/figure-"$1".exr --label "a direct light" --label "b with scattered light"
}

figure_11() { figure_10 "$1"; }

figure_12() {
  render figure-12 12 --frames 0..3
  join 12 12/figure-12.000{0,1,2}.exr --label "frame 0" --label "frame 1" --label "frame 2"
}

mkdir -p "$out/parts"
for figure in "${figures[@]}"; do "figure_$figure" "$figure"; done
