# Finds sequential MUMPS in double precision, which is loaded at run time. Sets MUMPS_INCLUDE_DIR and the name of the
# library's file, MUMPS_FILE
find_path(MUMPS_INCLUDE_DIR dmumps_c.h)
find_library(MUMPS_LIBRARY dmumps_seq)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(MUMPS REQUIRED_VARS MUMPS_LIBRARY MUMPS_INCLUDE_DIR)
if(MUMPS_FOUND AND NOT MUMPS_FILE)
  # the file name that contains the version of the header: libdmumps_seq-5.5.so, to which libdmumps_seq.so links
  execute_process(COMMAND ${CMAKE_OBJDUMP} -p ${MUMPS_LIBRARY} OUTPUT_VARIABLE MUMPS_SECTIONS)
  string(REGEX MATCH "SONAME +([^ \n]+)" MUMPS_MATCH "${MUMPS_SECTIONS}")
  if(NOT MUMPS_MATCH)
    message(FATAL_ERROR "${MUMPS_LIBRARY} has no SONAME: MUMPS as a shared library is required")
  endif()
  set(MUMPS_FILE ${CMAKE_MATCH_1} CACHE STRING "file loaded at run time")
endif()
mark_as_advanced(MUMPS_INCLUDE_DIR MUMPS_LIBRARY MUMPS_FILE)
