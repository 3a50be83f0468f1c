# cmake -DSOURCE_DIR=... -DOUTPUT=... -P commit.cmake: writes the commit of the source to a header. The header's time
# stamp changes only if the commit changes.
cmake_minimum_required(VERSION 3.25)
execute_process(COMMAND git --no-optional-locks -C ${SOURCE_DIR} describe --always --dirty --exclude=* --abbrev=12
  OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(NOT commit)
  set(commit "unknown")
endif()
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT "#pragma once\ninline constexpr const char* kCommit = \"@commit@\";\n" @ONLY)
