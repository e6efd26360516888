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

# build_preset PRESET CACHE-ENTRIES TARGETS: words in one string each; no targets: all.
build_preset() {
  local preset=$1 entries targets
  read -ra entries <<<"$2"
  read -ra targets <<<"$3"
  cmake --preset "$preset" -Wno-dev "${entries[@]}" >"build/configure-$preset.log" 2>&1 ||
    { tail -n 30 "build/configure-$preset.log" >&2; return 1; }
  cmake --build --preset "$preset" ${targets:+--target "${targets[@]}"}
}

mkdir -p build
