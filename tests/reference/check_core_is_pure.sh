#!/usr/bin/env bash
# check_core_is_pure.sh SOURCE_DIR STEP.a REFERENCE.a OTHER.a...
# Fails if core or the reference includes or calls parts that belong to the service: bus, log, clock, thread, file. core
# must not use SUNDIALS, and core/step must not use Eigen, the mathematical library or Boost either. tests/house/rooms.py
# checks which rooms include which.
# Exit codes: 0 core is pure, 1 it is not, 2 wrong arguments.
set -euo pipefail
case "${1:-}" in
  -h|--help) sed -n '2,6s/^# //p' "$0"; exit 0 ;;
esac
if [ $# -lt 4 ] || [ ! -d "$1/core" ] || [ ! -r "$2" ] || [ ! -r "$3" ] || [ ! -r "$4" ]; then
  echo "usage: check_core_is_pure.sh SOURCE_DIR STEP.a REFERENCE.a OTHER.a..." >&2
  exit 2
fi
source_dir="$1" step="$2" reference="$3"
shift 3
status=0

# forbid_includes FOLDER PATTERN
forbid_includes() {
  local found
  if found="$(grep -rnE --include='*.hpp' --include='*.cpp' "^[[:space:]]*#[[:space:]]*include[[:space:]]*[<\"]($2)" "$source_dir/$1")"; then
    printf 'forbidden include in %s:\n%s\n' "$1" "$found"
    status=1
  fi
}

# forbid_symbols ARCHIVE PATTERN: compares the pattern with the undefined symbols, demangled
forbid_symbols() {
  local undefined found
  undefined="$(nm --undefined-only --demangle "$1" | sed -n 's/^ *[UwV] //p' | sort -u)"
  [ -n "$undefined" ] || { echo "$1 has no undefined symbol at all: not what was to be checked"; exit 1; }
  if found="$(grep -E "^($2)" <<<"$undefined")"; then
    printf 'forbidden symbol in %s:\n%s\n' "$1" "$found"
    status=1
  fi
}

service_headers='lcm/|spdlog/|fmt/|chrono>|ctime>|time\.h>|sys/|unistd|pthread|thread>|mutex>|shared_mutex>|condition_variable>|future>|atomic>|semaphore>|fstream>|iostream>|cstdio>|stdio\.h>|filesystem>|fcntl|libfyaml|CLI/|nlohmann/|messages/|freeflex_msgs/|service/|tools/|tests/'
service_symbols='lcm_|spdlog|fmt::|clock_gettime|gettimeofday|time$|nanosleep|clock_nanosleep|std::chrono|pthread_create|pthread_mutex_lock|std::thread|std::mutex|open$|open64$|fopen|fopen64|std::basic_[io]*fstream|std::basic_filebuf|std::cout|std::cerr|std::filesystem|printf|puts$|fputs|fwrite|socket$|fy_'

forbid_includes core "$service_headers|cvode/|arkode/|sundials/|nvector/"
forbid_includes tools/verification/reference "${service_headers/|tools\//|tools/(bus|cli|plot|python|terminal|view)/}"
for archive in "$step" "$reference" "$@"; do forbid_symbols "$archive" "$service_symbols"; done
for archive in "$step" "$@"; do forbid_symbols "$archive" 'CVode|ARK|ERKStep|N_V|SUN'; done

forbid_includes core/step 'Eigen/|boost/|cmath>|math\.h>|complex>|numeric>|random>'
# sqrt is rounded exactly on every machine; the compiler keeps the call only for a negative argument
forbid_symbols "$step" 'sin|cos|tan|exp|log|pow|cbrt|hypot|fma|sincos|asin|acos|atan|floor|ceil|round|remainder|fmod|std::(sin|cos|exp|pow|log)|Eigen::'

[ $status = 0 ] && echo "core is pure"
exit $status
