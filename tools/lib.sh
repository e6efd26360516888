# Shared by tools/demo and tools/test: sets `root`, steps with their time, and the build of one preset.
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"

step() {
  local name=$1 start=$SECONDS
  shift
  echo "== $name"
  "$@" || { echo "$(basename "$0"): error: $name failed" >&2; exit 1; }
  echo "   $name: $((SECONDS - start)) s"
}

# configure_preset PRESET CACHE-ENTRY...
configure_preset() {
  cmake --preset "$1" -Wno-dev "${@:2}" >"build/configure-$1.log" 2>&1 ||
    { tail -n 30 "build/configure-$1.log" >&2; return 1; }
}

# build_preset PRESET CACHE-ENTRIES TARGETS: words in one string each; no targets: all.
build_preset() {
  local entries targets
  read -ra entries <<<"$2"
  read -ra targets <<<"$3"
  configure_preset "$1" "${entries[@]}" || return 1
  cmake --build --preset "$1" ${targets:+--target "${targets[@]}"}
}

mkdir -p build
