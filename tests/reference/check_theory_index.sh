#!/usr/bin/env bash
# check_theory_index.sh SOURCE_DIR: holds the index of equations in core/THEORY.md against the tree: every file that it
# names is there and cites the number of its row, and every number that the code of core cites stands in it.
# Exit 0 it holds, 1 not, 2 wrong arguments.
set -euo pipefail
case "${1:-}" in
  -h|--help) sed -n '2,4s/^# //p' "$0"; exit 0 ;;
esac
if [ $# -ne 1 ] || [ ! -r "$1/core/THEORY.md" ]; then
  echo "usage: check_theory_index.sh SOURCE_DIR" >&2
  exit 2
fi
cd "$1"
status=0
rows="$(sed -n '/^## 15 /,$p' core/THEORY.md | grep -E '^\| [X0-9]')"
numbers="$(cut -d'|' -f2 <<<"$rows" | tr -d ' ')"

# cites NUMBER FILE: names it, or a range that holds it
cites() {
  local sources=() from to
  for source in {core/,}"$2".{hpp,cpp}; do [ ! -e "$source" ] || sources+=("$source"); done
  grep -qE "(^|[^0-9.X])${1//./\\.}([^0-9.]|\.[^0-9]|\.?$)" "${sources[@]}" && return 0
  while read -r from to; do
    [ "${1#X}" -ge "$from" ] && [ "${1#X}" -le "$to" ] && return 0
  done < <(grep -ohE 'X[0-9]+( to |-)X[0-9]+' "${sources[@]}" | sed -E 's/X([0-9]+)( to |-)X([0-9]+)/\1 \3/')
  return 1
}

while read -r file; do
  [ -e "core/$file.cpp" ] || [ -e "core/$file.hpp" ] || [ -e "$file.cpp" ] || [ -e "$file.hpp" ] && continue
  echo "the index names $file, which is not there"
  status=1
done < <(grep -o '`[^`]*/[^`]*`' <<<"$rows" | tr -d '`' | sort -u)

while read -r number; do
  grep -qx -- "${number%[a-f]}" <<<"$numbers" && continue
  echo "$number is cited in core, and is not in the index: $(grep -rlw --include='*.[ch]pp' "$number" core | head -n 1)"
  status=1
done < <(grep -rhoE --include='*.[ch]pp' '\bX[0-9]+[a-f]?\b' core | sort -u)

while IFS='|' read -r _ number _ _ files; do
  number="${number// /}"
  for file in $(grep -o '`[^`]*`' <<<"$files" | tr -d '`'); do
    cites "$number" "$file" && continue
    echo "the index says that $file implements $number, which it does not cite"
    status=1
  done
done <<<"$rows"

repeated="$(sort <<<"$numbers" | uniq -d)"
[ -z "$repeated" ] || { echo "twice in the index: $repeated"; status=1; }
[ $status = 0 ] && echo "the index of $(wc -l <<<"$numbers") equations holds"
exit $status
