#!/usr/bin/env bash
# check_sources.sh SOURCE_DIR BINARY_DIR LIST: fails if no CMake target compiles a .cpp file of the tree, and names
# the file, because a test that is not compiled tests nothing. CMake writes LIST, which contains the sources of all
# targets, one absolute path per line. The script also works in a tree without .git.
# Exit codes: 0 every source is in a target, 1 a source is in no target, 2 wrong arguments.
set -euo pipefail
case "${1:-}" in
  -h|--help) sed -n '2,5s/^# //p' "$0"; exit 0 ;;
esac
if [ $# -ne 3 ] || [ ! -d "$1/core" ] || [ ! -d "$2" ] || [ ! -s "$3" ]; then
  echo "usage: check_sources.sh SOURCE_DIR BINARY_DIR LIST" >&2
  exit 2
fi
source_dir="$(readlink -f "$1")" binary_dir="$(readlink -f "$2")" list="$3"
status=0

# files that are not compiled by a target of this build, and what compiles them
declare -A exempt=(
  [tests/bits/hash_steps.cpp]="tests/bits/one_set_of_bits compiles it with two compilers in many ways"
  [tools/examples/controller.cpp]="tests/tools/install_test.cpp builds it against the installed package"
  [tests/bench/modal_rivals.cpp]="in bench_sparse only where Spectra, ARPACK and CHOLMOD are installed"
)
for file in "${!exempt[@]}"; do
  if [ ! -f "$source_dir/$file" ]; then
    echo "tests/check_sources.sh exempts $file (${exempt[$file]}), which does not exist: take it out of the script"
    status=1
  fi
done

# build directories contain files that CMake and the compiler write
mapfile -t files < <(find "$source_dir" -mindepth 1 \( -path "$source_dir/build" -o -path "$binary_dir" -o -name '.?*' \) -prune \
  -o -type f -name '*.cpp' -print | sort)
[ ${#files[@]} -gt 100 ] || { echo "found only ${#files[@]} .cpp files in $source_dir: this is not the source tree"; exit 1; }
declare -A listed
while IFS= read -r line; do listed["$line"]=1; done <"$list"
for path in "${files[@]}"; do
  file="${path#"$source_dir"/}"
  if [ -z "${listed[$path]:-}" ] && [ -z "${exempt[$file]:-}" ]; then
    echo "$file is in no CMake target: add it to the SOURCES of a target in ${file%/*}/CMakeLists.txt, or delete it"
    status=1
  fi
done

[ $status = 0 ] && echo "all ${#files[@]} sources are in a target"
exit $status
