# what cmake --install gives: programs, libraries, headers, message types, scenes, an example and the CMake package
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/freeflex)
set(header_dir ${CMAKE_INSTALL_INCLUDEDIR}/freeflex)

set_target_properties(freeflex_step PROPERTIES EXPORT_NAME step)
set_target_properties(freeflex_core PROPERTIES EXPORT_NAME core)
set_target_properties(freeflex_io PROPERTIES EXPORT_NAME io)
install(TARGETS freeflex_options freeflex_step freeflex_core freeflex_messages freeflex_io
  EXPORT freeflex ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT freeflex NAMESPACE freeflex:: DESTINATION ${package_dir} FILE freeflexTargets.cmake)
configure_package_config_file(tools/cmake/freeflexConfig.cmake.in ${CMAKE_BINARY_DIR}/freeflexConfig.cmake
  INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/freeflexConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/freeflexConfig.cmake ${CMAKE_BINARY_DIR}/freeflexConfigVersion.cmake
  DESTINATION ${package_dir})

install(TARGETS freeflex_cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
if(TARGET freeflexd)
  install(TARGETS freeflexd RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
foreach(folder core/step core/model service/io messages)
  install(DIRECTORY ${folder}/ DESTINATION ${header_dir}/${folder} FILES_MATCHING PATTERN "*.hpp")
endforeach()
install(DIRECTORY ${CMAKE_BINARY_DIR}/generated/freeflex_msgs DESTINATION ${header_dir} FILES_MATCHING PATTERN "*.hpp")
install(DIRECTORY messages/ DESTINATION ${CMAKE_INSTALL_DATADIR}/freeflex/lcm FILES_MATCHING PATTERN "*.lcm")
install(DIRECTORY tests/tools/controller DESTINATION ${CMAKE_INSTALL_DATADIR}/freeflex/examples)
install(DIRECTORY service/scenes/ DESTINATION ${CMAKE_INSTALL_DATADIR}/freeflex/scenes)
