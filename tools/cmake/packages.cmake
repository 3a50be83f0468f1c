# .deb packages: cpack -G DEB, or tools/packages/make
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME freeflex)
set(CPACK_PACKAGE_VENDOR freeflex)
set(CPACK_PACKAGE_CONTACT "${FREEFLEX_CONTACT}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
# empty, because a common summary would precede the summary in each package's description
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")
set(CPACK_STRIP_FILES ON)
set(CPACK_VERBATIM_VARIABLES ON)
set(CPACK_COMPONENTS_ALL programs development python)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(CPACK_DEBIAN_PROGRAMS_PACKAGE_NAME freeflex)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SECTION science)
# the package contains libfreeflex.so.1
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
file(WRITE ${CMAKE_BINARY_DIR}/triggers "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_CONTROL_EXTRA ${CMAKE_BINARY_DIR}/triggers)
# these libraries are loaded at run time for large scenes, so dpkg-shlibdeps does not find them
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_DEPENDS "libmumps-seq-5.5, libopenblas0-serial")
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_RECOMMENDS "python3-freeflex (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_PROGRAMS_DESCRIPTION "Real-time simulation of free flexible structures
The daemon freeflexd keeps a free flexible structure in state, takes forces
over LCM and publishes its motion at a fixed rate. The program freeflex checks
and compiles scenes, runs, records, replays, compares and shows them.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libfreeflex-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
  "freeflex (= ${PROJECT_VERSION}), libeigen3-dev, liblcm-dev, libsodium-dev, libfyaml-dev, libxxhash-dev, libboost-dev, nlohmann-json3-dev")
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION "Real-time simulation of free flexible structures (development)
The C interface freeflex.h with its pkg-config file, the message types, and
the C++ libraries of the method with their CMake package.")

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-freeflex)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= 3.11), freeflex (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${CMAKE_CURRENT_LIST_DIR}/../packages/python/postinst
  ${CMAKE_CURRENT_LIST_DIR}/../packages/python/prerm)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-numpy")
set(CPACK_DEBIAN_PYTHON_DESCRIPTION "Real-time simulation of free flexible structures (Python)
Connects to the daemon freeflexd, subscribes, pushes and steps it, reads its
recordings, and steps plans in the program itself by the C interface.")
include(CPack)
