# installs programs, libraries, headers, message types and their document, licence, scenes and their schema, an example,
# and the CMake package with its components messages, client and core
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/freeflex)
set(header_dir ${CMAKE_INSTALL_INCLUDEDIR}/freeflex)

# freeflex::messages needs only LCM, so it is a component of its own
install(TARGETS freeflex_messages EXPORT freeflexMessages COMPONENT development)
# likewise freeflex::client, which needs libsodium in addition, and the code that it shares with the core
set(Wire_targets freeflex_options freeflex_step freeflex_io_wire)
set(Client_targets freeflex_bus_socket freeflex_client)
set(Core_targets freeflex_scene freeflex_structure freeflex_plan freeflex_error freeflex_motion freeflex_core freeflex_io_scene
  freeflex_io)
foreach(set Wire Client Core)
  foreach(target IN LISTS ${set}_targets)
    string(REPLACE "freeflex_" "" name ${target})
    set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  endforeach()
  install(TARGETS ${${set}_targets} EXPORT freeflex${set} ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
    COMPONENT development)
endforeach()
foreach(set Messages Wire Client Core)
  install(EXPORT freeflex${set} NAMESPACE freeflex:: DESTINATION ${package_dir} FILE freeflex${set}Targets.cmake
    COMPONENT development)
endforeach()
configure_package_config_file(tools/cmake/freeflexConfig.cmake.in ${CMAKE_BINARY_DIR}/freeflexConfig.cmake
  INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/freeflexConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/freeflexConfig.cmake ${CMAKE_BINARY_DIR}/freeflexConfigVersion.cmake
  DESTINATION ${package_dir} COMPONENT development)

install(TARGETS freeflex_cli freeflex_study RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT programs)
if(TARGET freeflexd)
  install(TARGETS freeflexd RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT programs)
endif()
install(FILES core/command_limits.hpp core/faults.hpp core/index.hpp core/limits.hpp core/motion.hpp core/plan.hpp core/rounding.hpp core/widths.hpp core/words.hpp DESTINATION ${header_dir}/core
  COMPONENT development)
foreach(folder core/step core/scene core/structure core/plan core/error service/io messages)
  install(DIRECTORY ${folder}/ DESTINATION ${header_dir}/${folder} COMPONENT development FILES_MATCHING PATTERN "*.hpp")
endforeach()
install(FILES service/client/client.hpp service/client/scene_catalogue.hpp DESTINATION ${header_dir}/service/client
  COMPONENT development)
install(DIRECTORY ${CMAKE_BINARY_DIR}/generated/freeflex_msgs DESTINATION ${header_dir} COMPONENT development
  FILES_MATCHING PATTERN "*.hpp")
install(DIRECTORY messages/ DESTINATION ${CMAKE_INSTALL_DATADIR}/freeflex/lcm COMPONENT programs
  FILES_MATCHING PATTERN "*.lcm")
install(FILES messages/README.md DESTINATION ${CMAKE_INSTALL_DATADIR}/freeflex/lcm COMPONENT programs)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT programs)
install(DIRECTORY tools/examples/ DESTINATION ${CMAKE_INSTALL_DATADIR}/freeflex/examples/controller COMPONENT development)
install(DIRECTORY service/scenes/ DESTINATION ${CMAKE_INSTALL_DATADIR}/freeflex/scenes COMPONENT programs)

# the C interface with its pkg-config file, and Python
configure_file(tools/cmake/freeflex.pc.in ${CMAKE_BINARY_DIR}/freeflex.pc @ONLY)
install(TARGETS freeflex_c LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT programs NAMELINK_COMPONENT development)
install(FILES service/c/freeflex.h service/c/freeflex_blocks.hpp DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
install(FILES ${CMAKE_BINARY_DIR}/freeflex.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
install(DIRECTORY ${CMAKE_BINARY_DIR}/python/freeflex DESTINATION ${FREEFLEX_PYTHON_DIR} COMPONENT python
  FILES_MATCHING PATTERN "location.py" EXCLUDE PATTERN "*.py")
install(FILES ${CMAKE_BINARY_DIR}/python_installed/location.py DESTINATION ${FREEFLEX_PYTHON_DIR}/freeflex COMPONENT python)
# if the prefix is one that Python searches, such as a virtual environment or /usr/local, Python finds the package
# without PYTHONPATH; not for the .deb packages
foreach(packages site-packages dist-packages)
  set(folder lib/python${Python3_VERSION_MAJOR}.${Python3_VERSION_MINOR}/${packages})
  file(RELATIVE_PATH from_folder /prefix/${folder} /prefix/${FREEFLEX_PYTHON_DIR})
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/python_installed/${packages}/freeflex.pth CONTENT "@from_folder@\n" @ONLY)
  install(FILES ${CMAKE_BINARY_DIR}/python_installed/${packages}/freeflex.pth DESTINATION ${folder} COMPONENT python_path)
endforeach()
install(FILES tools/python/README.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/python3-freeflex COMPONENT python)

# manual pages, completion and schema, and the documents
set(share ${CMAKE_BINARY_DIR}/share)
install(DIRECTORY ${share}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT programs FILES_MATCHING PATTERN "*.1.gz")
install(FILES ${share}/bash-completion/freeflex DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
  COMPONENT programs)
install(FILES ${share}/scene.schema.json DESTINATION ${CMAKE_INSTALL_DATADIR}/freeflex COMPONENT programs)
install(DIRECTORY ${share}/html DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT programs)
foreach(package freeflex:programs libfreeflex-dev:development python3-freeflex:python)
  string(REPLACE ":" ";" package ${package})
  list(POP_FRONT package folder)
  install(FILES ${share}/copyright ${share}/changelog.gz DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${folder}
    COMPONENT ${package})
endforeach()
