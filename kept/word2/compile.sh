#!/bin/bash
# compile.sh FILE.cpp PROGRAM : one gtest source against the prebuilt libraries
set -e
B=/tmp/rd/wordbuild
cd $B
src=$(readlink -f "$OLDPWD/$1" 2>/dev/null || readlink -f "$1"); out="$2"; case "$out" in /*) ;; *) out="$OLDPWD/$out";; esac
nice g++ -O1 -w -pthread -ffp-contract=off -std=c++20 -DGTEST_HAS_PTHREAD=1 -I/tmp/rd/word -I"$(dirname "$src")" -isystem /usr/include/eigen3 -isystem $B/generated $(pkg-config --cflags glib-2.0) "$src" -o "$out" $(sed -n '/build tests\/word_long_test tests/,/LINK_LIBRARIES/p' build.ninja | grep LINK_LIBRARIES | sed 's/.*LINK_LIBRARIES = //')
