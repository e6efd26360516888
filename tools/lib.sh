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

# configure_and_build PRESET [cmake --build arguments]
configure_and_build() {
  local preset=$1
  shift
  cmake --preset "$preset" -Wno-dev >"build/configure-$preset.log" 2>&1 ||
    { tail -n 30 "build/configure-$preset.log" >&2; return 1; }
  cmake --build --preset "$preset" "$@"
}

mkdir -p build
